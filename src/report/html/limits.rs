//! Each value with its limits, and the verdict about it.

use super::markup::{cells, table};
use crate::number::share;
use crate::results::{judged_name, judged_value};
use epirig_core::choice::Choice as _;
use epirig_surface::conformity::{Conformity, Judgement};
use maud::{Markup, html};

pub(super) fn limits(conformity: &Conformity) -> Markup {
    let head = ["characteristic", "limits", "value, 95 % coverage", "conformance probability", "verdict"];
    let rule = conformity.rule;
    html! {
        (table("Limits and verdict", &head, html! { @for one in &conformity.judgements { (row(one)) } }))
        p {
            "Decision rule " (rule) ": " (rule.help())
            @if let Some(risk) = conformity.risk { " The risk is " (share(risk)) "." }
        }
    }
}

fn row(one: &Judgement) -> Markup {
    let probability = one.conformance_probability.map_or("not known".to_owned(), share);
    let why = one.undecided.as_ref().map_or(String::new(), |why| format!(": {why}"));
    let value = judged_value(one);
    cells(judged_name(one), [&one.limits.to_string(), &value, &probability, &format!("{}{why}", one.verdict)])
}
