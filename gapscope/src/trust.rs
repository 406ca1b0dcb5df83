//! How well the inertial parameters of links are known: `--trust`.

use anyhow::{Result, bail};
use gapscope_dynamics::{InertialSource, Model};

/// What `--trust` may say of links, with what it means.
const SOURCES: [(&str, InertialSource); 3] =
    [("weighed", InertialSource::Weighed), ("cad", InertialSource::Cad), ("guessed", InertialSource::Guessed)];

/// The model with links trusted as the command line says: `SOURCE` for all links, `LINK=SOURCE` for one, `LINK=1.2kg` for one
/// that was weighed with its tool; the last word counts. A link is named by its own name or by that of the joint that moves it.
///
/// # Errors
/// A source or a link that there is not, or a mass that no link has.
pub fn trusting(mut model: Model, words: &[String]) -> Result<Model> {
    for word in words {
        let (link, name) = word.rsplit_once('=').map_or((None, word.as_str()), |(link, name)| (Some(link), name));
        let source = SOURCES.iter().find(|(known, _)| *known == name).map(|(_, source)| *source);
        let mass = name.strip_suffix("kg").and_then(|mass| mass.trim().parse::<f64>().ok());
        if source.is_none() && mass.is_none() {
            let known: Vec<&str> = SOURCES.iter().map(|(known, _)| *known).collect();
            bail!(
                "--trust {word}: `{name}` is no source of inertials\nhelp: Say {}, or of a link its mass, as `LINK=1.2kg`",
                known.join(", ")
            );
        }
        if let Some(mass) = mass.filter(|mass| !(mass.is_finite() && *mass > 0.0) || link.is_none()) {
            bail!(
                "--trust {word}: {mass} kg is the mass of no link\nhelp: Name one link and what it weighs with its tool, as `LINK=1.2kg`"
            );
        }
        let of = |j: usize| link.is_none_or(|link| model.joints()[j].link == link || model.joints()[j].name == link);
        let joints: Vec<usize> = (0..model.dof()).filter(|&j| of(j)).collect();
        if joints.is_empty() {
            let links: Vec<&str> = model.joints().iter().map(|joint| joint.link.as_str()).collect();
            bail!("--trust {word}: no joint moves such a link\nhelp: The links that move are {}", links.join(", "));
        }
        model = joints.into_iter().fold(model, |model, j| match mass {
            Some(mass) => model.with_mass(j, mass).with_inertial_source(j, InertialSource::MassKnown),
            None => model.with_inertial_source(j, source.unwrap_or_default()),
        });
    }
    Ok(model)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    fn trusted(words: &[&str]) -> Result<Model> {
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        trusting(robots::model("arm6").unwrap().unwrap().model, &words)
    }

    #[test]
    fn the_last_word_on_a_link_counts() {
        let model = trusted(&["weighed", "link6=guessed", "joint5=cad"]).unwrap();
        let sources: Vec<InertialSource> = (0..model.dof()).map(|j| model.inertial_source(j)).collect();
        assert_eq!(sources[..4], [InertialSource::Weighed; 4]);
        assert_eq!(sources[4..], [InertialSource::Cad, InertialSource::Guessed]);
    }

    #[test]
    fn a_tool_that_was_weighed_gives_its_link_that_mass_and_leaves_open_where_it_lies() {
        let (plain, with) = (trusted(&[]).unwrap(), trusted(&["link6=2.5kg"]).unwrap());
        let (before, after) = (&plain.joints()[5].inertia, &with.joints()[5].inertia);
        assert_eq!((after.mass, with.inertial_source(5)), (2.5, InertialSource::MassKnown));
        let centre = |body: &gapscope_dynamics::Inertia| body.center_of_mass().unwrap();
        assert!((centre(before) - centre(after)).length() < 1e-12);
    }

    #[test]
    fn what_there_is_not_is_named_with_what_there_is() {
        let error = |words: &[&str]| trusted(words).unwrap_err().to_string();
        assert!(error(&["known"]).contains("weighed, cad, guessed"));
        assert!(error(&["link9=cad"]).contains("link6"));
        assert!(error(&["1.2kg"]).contains("Name one link"));
        assert!(error(&["link6=-1kg"]).contains("-1 kg"));
    }
}
