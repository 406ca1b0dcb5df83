//! The comparisons that decided, as a list that unfolds.

use super::words;
use gapscope_diagnosis::schema::Why;
use maud::{Markup, html};

/// Comparisons that are listed; the rest is in `diagnosis.json`.
const LISTED: usize = 60;

/// One entry for each kind that was taken, then one for all that was turned down; `None` where nothing was compared.
pub fn render(why: &[Why], joints: &[String]) -> Option<Markup> {
    let (mut taken, mut not): (Vec<&Why>, Vec<&Why>) = why.iter().partition(|why| why.taken);
    for list in [&mut taken, &mut not] {
        list.sort_by(|a, b| b.odds.total_cmp(&a.odds));
    }
    if taken.is_empty() && not.is_empty() {
        return None;
    }
    let group = |title: &str, list: &[&Why], open: bool| {
        html! {
            @if !list.is_empty() {
                details open[open] {
                    summary { (title) " (" (list.len()) ")" }
                    ul.why { @for why in list.iter().take(LISTED) { (entry(why, joints)) } }
                    @if list.len() > LISTED { p.note { "and " (list.len() - LISTED) " more in diagnosis.json" } }
                }
            }
        }
    };
    Some(html! {
        p.note {
            "In nats: 3 are odds of twenty to one."
            @if taken.iter().any(|why| why.odds < 0.0) { " Below zero: the logs speak more for the account that it stands against." }
        }
        (group("Taken", &taken, true))
        (group("Turned down", &not, false))
    })
}

fn entry(why: &Why, joints: &[String]) -> Markup {
    let odds = if why.odds.is_finite() { format!("{:+.1}", why.odds).replace('-', "−") } else { super::NONE.into() };
    html! {
        li data-joints=(super::listed(&why.joints)) {
            b.odds { (odds) }
            span {
                (words::capital(&words::effect(&why.proposed)))
                @if !why.joints.is_empty() { " at " (words::joints(&why.joints, joints)) }
                span.muted { " against " (words::account(&why.against)) }
            }
        }
    }
}
