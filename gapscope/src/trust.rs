//! How well the inertial parameters of links are known: `--trust`.

use anyhow::{Result, bail};
use gapscope_dynamics::{InertialSource, Model};

/// What `--trust` may say of links, with what it means.
const SOURCES: [(&str, InertialSource); 3] =
    [("weighed", InertialSource::Weighed), ("cad", InertialSource::Cad), ("guessed", InertialSource::Guessed)];

/// The model with links trusted as the command line says: `SOURCE` for all links, `LINK=SOURCE` for one, the last word counts.
/// A link is named by its own name or by that of the joint that moves it.
///
/// # Errors
/// A source or a link that there is not.
pub fn trusting(mut model: Model, words: &[String]) -> Result<Model> {
    for word in words {
        let (link, name) = word.rsplit_once('=').map_or((None, word.as_str()), |(link, name)| (Some(link), name));
        let Some((_, source)) = SOURCES.iter().find(|(known, _)| *known == name) else {
            let known: Vec<&str> = SOURCES.iter().map(|(known, _)| *known).collect();
            bail!("--trust {word}: `{name}` is no source of inertials\nhelp: Say {}", known.join(", "));
        };
        let of = |j: usize| link.is_none_or(|link| model.joints()[j].link == link || model.joints()[j].name == link);
        let joints: Vec<usize> = (0..model.dof()).filter(|&j| of(j)).collect();
        if joints.is_empty() {
            let links: Vec<&str> = model.joints().iter().map(|joint| joint.link.as_str()).collect();
            bail!("--trust {word}: no joint moves such a link\nhelp: The links that move are {}", links.join(", "));
        }
        model = joints.into_iter().fold(model, |model, j| model.with_inertial_source(j, *source));
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
    fn what_there_is_not_is_named_with_what_there_is() {
        let error = |words: &[&str]| trusted(words).unwrap_err().to_string();
        assert!(error(&["known"]).contains("weighed, cad, guessed"));
        assert!(error(&["link9=cad"]).contains("link6"));
    }
}
