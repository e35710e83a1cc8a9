//! `lucerna plugins`: what a scene can choose, from the tables themselves.

use super::Failure;
use clap::Args;
use lucerna_core::scene::{ObjectKind, Plugin, Registry, did_you_mean};
use std::process::ExitCode;

/// Options of `plugins`.
#[derive(Args)]
pub struct Arguments {
    /// A kind, such as bsdf; all kinds by default
    kind: Option<String>,
    /// A plugin of that kind
    name: Option<String>,
}

/// Prints the tables.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Some(text) = &arguments.kind else {
        for kind in ObjectKind::ALL {
            list(registry, kind);
        }
        return Ok(ExitCode::SUCCESS);
    };
    let kind = ObjectKind::from_tag(text).or_else(|| ObjectKind::from_tag(text.trim_end_matches('s')));
    let kind = kind.ok_or_else(|| {
        let tags = ObjectKind::ALL.iter().map(|k| k.tag());
        let hint = did_you_mean(text, tags.clone()).map_or_else(
            || format!("one of {}", tags.collect::<Vec<_>>().join(", ")),
            |t| format!("did you mean \"{t}\"?"),
        );
        Failure::new(format!("there is no kind of plugin called \"{text}\" ({hint})"))
    })?;
    let Some(name) = &arguments.name else {
        list(registry, kind);
        return Ok(ExitCode::SUCCESS);
    };
    let plugin = registry.find(kind, name).ok_or_else(|| {
        let message = format!("there is no {} called \"{name}\"", kind.tag());
        match did_you_mean(name, registry.of_kind(kind).map(|p| p.name)) {
            Some(meant) => Failure::new(format!("{message} (did you mean \"{meant}\"?)")),
            None => Failure::new(message),
        }
    })?;
    describe(plugin);
    Ok(ExitCode::SUCCESS)
}

fn list(registry: &Registry, kind: ObjectKind) {
    let mut plugins = registry.of_kind(kind).peekable();
    if plugins.peek().is_some() {
        println!("{}", kind.tag());
        for plugin in plugins {
            println!("  {:<18} {}", plugin.name, plugin.summary);
        }
    }
}

fn describe(plugin: &Plugin) {
    println!("{} \"{}\": {}", plugin.build.kind().tag(), plugin.name, plugin.summary);
    if !plugin.aliases.is_empty() {
        println!("also called: {}", plugin.aliases.join(", "));
    }
    let rows: Vec<[String; 4]> = plugin
        .all_params()
        .map(|p| {
            let range = match (p.min.is_finite(), p.max.is_finite()) {
                (false, false) => String::new(),
                _ => format!(" ({})", p.range_text()),
            };
            [p.name.to_owned(), p.type_text().into_owned(), p.default_text(), format!("{}{range}", p.doc)]
        })
        .collect();
    let width = |i: usize| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0);
    let (w0, w1, w2) = (width(0), width(1), width(2));
    for [name, ty, default, doc] in &rows {
        println!("  {name:<w0$}  {ty:<w1$}  {default:<w2$}  {doc}");
    }
}
