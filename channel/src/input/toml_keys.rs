//! Values of a TOML table by keys with dots.

use toml::{Table, Value};

/// The value of a key; `None` where it is left out.
pub fn find<'t>(table: &'t Table, key: &str) -> Option<&'t Value> {
    match key.split_once('.') {
        None => table.get(key),
        Some((first, rest)) => find(table.get(first)?.as_table()?, rest),
    }
}

/// Sets or takes away the value of a key.
pub fn put(table: &mut Table, key: &str, value: Option<Value>) {
    match (key.split_once('.'), value) {
        (Some((first, rest)), value) => {
            if let Some(inner) = table.get_mut(first).and_then(Value::as_table_mut) {
                put(inner, rest, value);
            }
        }
        (None, Some(value)) => {
            table.insert(key.to_owned(), value);
        }
        (None, None) => {
            table.remove(key);
        }
    }
}
