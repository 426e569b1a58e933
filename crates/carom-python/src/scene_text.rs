//! The text of a scene file, TOML or JSON, to Python objects; and, when an error must name a line, the line of any value.
//!
//! Almost every scene is right, so lines are not collected on the way: [`Lines`] keeps the text and parses it once more
//! when it is first asked.

use std::sync::OnceLock;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};

/// A value of the file and the byte at which it begins.
struct Node {
    offset: usize,
    value: Value,
}

/// What both languages can say, and nothing else.
enum Value {
    Null,
    Boolean(bool),
    Integer { digits: String, radix: u32 },
    Float(f64),
    Text(String),
    List(Vec<Node>),
    Table(Vec<Field>),
}

struct Field {
    name: String,
    offset: usize,
    node: Node,
}

/// What is wrong with the text itself, and the byte at which.
struct TextError {
    message: String,
    offset: usize,
}

impl TextError {
    /// `ValueError(message, line, column)`, both counted from 1.
    fn raise(&self, text: &str) -> PyErr {
        let (line, column) = line_and_column(text, self.offset);
        PyValueError::new_err((self.message.clone(), line, column))
    }
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line = before.bytes().filter(|&byte| byte == b'\n').count() + 1;
    let column = before.chars().rev().take_while(|&letter| letter != '\n').count() + 1;
    (line, column)
}

#[derive(Clone, Copy)]
enum Language {
    Toml,
    Json,
}

impl Language {
    fn parse(self, text: &str) -> Result<Node, TextError> {
        match self {
            Self::Toml => toml_node(text),
            Self::Json => json_node(text),
        }
    }
}

fn toml_node(text: &str) -> Result<Node, TextError> {
    let table = toml::de::DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        let message = match error.message() {
            "duplicate key" => format!("duplicate key `{}`", text.get(span.clone()).unwrap_or_default()),
            // Said of any bare word and of no value at all.
            "string values must be quoted, expected literal string" => {
                "expected a value: a number, text in quotes, true, false, a list or a table".to_string()
            }
            other => other.to_string(),
        };
        TextError { message, offset: span.start }
    })?;
    let value = toml_table(table.into_inner())?;
    Ok(Node { offset: 0, value })
}

fn toml_table(table: toml::de::DeTable<'_>) -> Result<Value, TextError> {
    let mut fields = table
        .into_iter()
        .map(|(name, value)| {
            let offset = name.span().start;
            Ok(Field { name: name.into_inner().into_owned(), offset, node: toml_value(value)? })
        })
        .collect::<Result<Vec<_>, TextError>>()?;
    // The parser sorts by name; what is reported follows the order of the file.
    fields.sort_by_key(|field| field.offset);
    Ok(Value::Table(fields))
}

fn toml_value(spanned: toml::Spanned<toml::de::DeValue<'_>>) -> Result<Node, TextError> {
    use toml::de::DeValue;
    let offset = spanned.span().start;
    let value = match spanned.into_inner() {
        DeValue::String(text) => Value::Text(text.into_owned()),
        DeValue::Integer(integer) => Value::Integer { digits: integer.as_str().to_string(), radix: integer.radix() },
        DeValue::Float(float) => Value::Float(number(float.as_str(), offset)?),
        DeValue::Boolean(boolean) => Value::Boolean(boolean),
        DeValue::Datetime(_) => {
            let message = "a date or a time of day is not a value that a scene has".to_string();
            return Err(TextError { message, offset });
        }
        DeValue::Array(list) => Value::List(list.into_iter().map(toml_value).collect::<Result<_, _>>()?),
        DeValue::Table(table) => toml_table(table)?,
    };
    Ok(Node { offset, value })
}

fn json_node(text: &str) -> Result<Node, TextError> {
    let options = jsonc_parser::ParseOptions {
        allow_comments: false,
        allow_loose_object_property_names: false,
        allow_trailing_commas: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    };
    let parsed = jsonc_parser::parse_to_ast(text, &jsonc_parser::CollectOptions::default(), &options)
        .map_err(|error| TextError { message: json_message(error.kind()), offset: error.range().start })?;
    match parsed.value {
        Some(value @ jsonc_parser::ast::Value::Object(_)) => json_value(value),
        _ => Err(TextError { message: "a scene is an object: expected `{`".to_string(), offset: 0 }),
    }
}

fn json_message(kind: &jsonc_parser::errors::ParseErrorKind) -> String {
    use jsonc_parser::errors::ParseErrorKind;
    match kind {
        ParseErrorKind::UnexpectedToken | ParseErrorKind::UnexpectedWord | ParseErrorKind::ExpectedObjectValue => {
            "expected a value: a number, text in double quotes, true, false, null, a list or an object".to_string()
        }
        ParseErrorKind::UnterminatedObject => "this object has no end: expected `}`".to_string(),
        ParseErrorKind::UnterminatedArray => "this list has no end: expected `]`".to_string(),
        other => {
            let message = other.to_string();
            let mut letters = message.chars();
            letters.next().map(|first| first.to_lowercase().to_string() + letters.as_str()).unwrap_or_default()
        }
    }
}

fn json_value(value: jsonc_parser::ast::Value<'_>) -> Result<Node, TextError> {
    use jsonc_parser::ast::Value as Json;
    use jsonc_parser::common::Ranged;
    let offset = value.range().start;
    let value = match value {
        Json::NullKeyword(_) => Value::Null,
        Json::BooleanLit(literal) => Value::Boolean(literal.value),
        Json::NumberLit(literal) if literal.value.contains(['.', 'e', 'E']) => {
            Value::Float(number(literal.value, offset)?)
        }
        Json::NumberLit(literal) => Value::Integer { digits: literal.value.to_string(), radix: 10 },
        Json::StringLit(literal) => Value::Text(literal.value.into_owned()),
        Json::Array(array) => Value::List(array.elements.into_iter().map(json_value).collect::<Result<_, _>>()?),
        Json::Object(object) => {
            let mut fields: Vec<Field> = Vec::with_capacity(object.properties.len());
            for property in object.properties {
                let offset = property.range.start;
                let name = property.name.into_string();
                if fields.iter().any(|field| field.name == name) {
                    return Err(TextError { message: format!("duplicate key \"{name}\""), offset });
                }
                fields.push(Field { name, offset, node: json_value(property.value)? });
            }
            Value::Table(fields)
        }
    };
    Ok(Node { offset, value })
}

fn number(digits: &str, offset: usize) -> Result<f64, TextError> {
    digits.parse().map_err(|_| TextError { message: format!("`{digits}` is not a number"), offset })
}

fn to_python<'py>(py: Python<'py>, node: &Node) -> PyResult<Bound<'py, PyAny>> {
    Ok(match &node.value {
        Value::Null => py.None().into_bound(py),
        Value::Boolean(boolean) => PyBool::new(py, *boolean).to_owned().into_any(),
        Value::Integer { digits, radix } => match i64::from_str_radix(digits, *radix) {
            Ok(small) => PyInt::new(py, small).into_any(),
            Err(_) => py.get_type::<PyInt>().call1((digits, radix))?,
        },
        Value::Float(float) => PyFloat::new(py, *float).into_any(),
        Value::Text(text) => PyString::new(py, text).into_any(),
        Value::List(list) => {
            let items = list.iter().map(|item| to_python(py, item)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Table(fields) => {
            let table = PyDict::new(py);
            for field in fields {
                table.set_item(PyString::intern(py, &field.name), to_python(py, &field.node)?)?;
            }
            table.into_any()
        }
    })
}

/// One step of the way to a value: a field's name or a place in a list.
#[derive(FromPyObject)]
enum Step {
    Place(usize),
    Name(String),
}

/// The lines of a scene file: `lines.line(("body", 3, "mass"))`.
#[pyclass(frozen, module = "carom._carom")]
pub struct Lines {
    text: String,
    language: Language,
    tree: OnceLock<Node>,
}

#[pymethods]
impl Lines {
    /// The line (counted from 1) on which the value at `path` begins; `path` is a tuple of field names and places in lists.
    ///
    /// Where the path leads to something that the file does not have, the line of the innermost table or list that it has.
    fn line(&self, path: Vec<Step>) -> usize {
        let Some(mut node) = self.tree() else { return 1 };
        let mut offset = node.offset;
        for step in path {
            (offset, node) = match (&node.value, step) {
                (Value::Table(fields), Step::Name(name)) => match fields.iter().find(|field| field.name == name) {
                    // A list of tables has no line of its own: what counts is the line of the table.
                    Some(field) => (field.offset, &field.node),
                    None => break,
                },
                (Value::List(list), Step::Place(place)) => match list.get(place) {
                    Some(item) => (item.offset, item),
                    None => break,
                },
                _ => break,
            };
        }
        line_and_column(&self.text, offset).0
    }
}

impl Lines {
    fn tree(&self) -> Option<&Node> {
        if self.tree.get().is_none() {
            // The text was parsed before, so it parses again.
            let _ = self.tree.set(self.language.parse(&self.text).ok()?);
        }
        self.tree.get()
    }
}

fn parse<'py>(py: Python<'py>, text: String, language: Language) -> PyResult<(Bound<'py, PyAny>, Lines)> {
    let node = language.parse(&text).map_err(|error| error.raise(&text))?;
    let object = to_python(py, &node)?;
    Ok((object, Lines { text, language, tree: OnceLock::new() }))
}

/// A TOML text as (dict, Lines). Raises ValueError(message, line, column).
#[pyfunction]
pub fn parse_toml(py: Python<'_>, text: String) -> PyResult<(Bound<'_, PyAny>, Lines)> {
    parse(py, text, Language::Toml)
}

/// A JSON text as (dict, Lines), the strict language: no comments, no trailing commas. Raises ValueError(message, line, column).
#[pyfunction]
pub fn parse_json(py: Python<'_>, text: String) -> PyResult<(Bound<'_, PyAny>, Lines)> {
    parse(py, text, Language::Json)
}
