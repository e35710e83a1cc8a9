//! Plugins in short form, as the command line takes them: `name` or `name:parameter=value,parameter=value`.

use lucerna_core::scene::{Location, Node, ObjectKind, Parameter, Value};

/// A plugin of this kind; `option` is where it was written, for messages.
///
/// # Errors
/// If a parameter has no value.
pub fn parse(kind: ObjectKind, text: &str, option: &str) -> Result<Node, String> {
    let (plugin, rest) = text.split_once(':').unwrap_or((text, ""));
    let at = Location::file(option.to_owned());
    let mut parameters = Vec::new();
    for item in rest.split(',').filter(|item| !item.is_empty()) {
        let (name, value) = key_value(item).map_err(|e| format!("{option} {text}: \"{item}\": {e}"))?;
        parameters.push(Parameter { name, value: plain_value(&value), at: at.clone() });
    }
    Ok(Node { kind, plugin: plugin.to_owned(), id: None, parameters, at, included_from: Vec::new() })
}

/// `key=value`.
///
/// # Errors
/// If it is not of that form.
pub fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err("expected name=value".to_owned()),
    }
}

/// A value: the narrowest type it can be.
pub fn plain_value(text: &str) -> Value {
    if let Ok(v) = text.parse::<i64>() {
        Value::Integer(v)
    } else if let Ok(v) = text.parse::<f64>() {
        Value::Float(v)
    } else if let Ok(v) = text.parse::<bool>() {
        Value::Boolean(v)
    } else {
        Value::String(text.to_owned())
    }
}
