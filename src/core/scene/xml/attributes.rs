//! The attributes of one element, with entities and `$parameters` replaced.

use super::definitions::Definitions;
use super::numbers::Wrong;
use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;
use quick_xml::events::attributes::AttrError;

/// More attributes than this on one element are an attack, not a scene.
const MOST: usize = 64;

/// The attributes of one element in the order of the file.
pub(super) struct Attributes {
    /// The element's name.
    pub tag: String,
    /// Whether an attribute has no usable value, which has been complained about.
    pub broken: bool,
    list: Vec<(String, String)>,
}

impl Attributes {
    /// Reads the attributes of `element`, and says what is wrong with them, one message per attribute with its hint.
    /// Namespace declarations are skipped.
    pub fn read(element: &BytesStart, definitions: &mut Definitions) -> (Self, Vec<(String, Option<String>)>) {
        let tag = element.name().into_inner().to_owned();
        let mut attributes = Attributes { tag, broken: false, list: Vec::new() };
        let mut wrong = Vec::new();
        for attribute in element.attributes().with_checks(false) {
            match attribute {
                Ok(attribute) => {
                    let name = attribute.key.into_inner();
                    if name == "xmlns" || name.starts_with("xmlns:") {
                        continue;
                    }
                    if attributes.get(name).is_some() {
                        wrong.push((format!("duplicate attribute \"{name}\" in element <{}>", attributes.tag), None));
                        continue;
                    }
                    let value = match attribute.normalized_value(XmlVersion::Implicit1_0) {
                        Ok(value) => definitions.substitute(&value),
                        Err(_) => Err(Some((
                            format!("\"&\" begins no entity in attribute \"{name}\" of element <{}>", attributes.tag),
                            Some("a plain & is written &amp;".to_owned()),
                        ))),
                    };
                    // A broken value still counts as given, so that one mistake makes one message.
                    let value = value.unwrap_or_else(|error| {
                        wrong.extend(error);
                        attributes.broken = true;
                        String::new()
                    });
                    attributes.list.push((name.to_owned(), value));
                }
                Err(error) => {
                    let message = format!("the attributes of element <{}> are malformed: ", attributes.tag);
                    wrong.push((message + plain(&error), None));
                    break;
                }
            }
            if attributes.list.len() > MOST {
                wrong.push((format!("element <{}> has more than {MOST} attributes", attributes.tag), None));
                break;
            }
        }
        (attributes, wrong)
    }

    /// The value of an attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.list.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// The value of an attribute that must be there.
    pub fn required(&self, name: &str) -> Result<&str, Wrong> {
        self.get(name).ok_or_else(|| (format!("missing required attribute \"{name}\" in <{}>", self.tag), None))
    }

    /// The names of all attributes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.list.iter().map(|(name, _)| name.as_str())
    }

    #[cfg(test)]
    pub fn from_list(tag: &str, list: &[(&str, &str)]) -> Self {
        let list = list.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        Attributes { tag: tag.to_owned(), broken: false, list }
    }
}

/// The reader's attribute errors without its byte positions: the element's line says where.
fn plain(error: &AttrError) -> &'static str {
    match error {
        AttrError::ExpectedEq(_) => "\"=\" is missing after a name",
        AttrError::ExpectedValue(_) => "a value is missing after \"=\"",
        AttrError::UnquotedValue(_) => "a value is not in quotes",
        AttrError::ExpectedQuote(..) => "a closing quote is missing",
        AttrError::Duplicated(..) => "an attribute is given twice",
    }
}
