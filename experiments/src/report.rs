//! What `--json` prints.

use serde_json::Value;

/// The fields of `common`, then those of `own`.
pub fn joined(mut common: Value, own: Value) -> Value {
    if let (Some(fields), Value::Object(own)) = (common.as_object_mut(), own) {
        fields.extend(own);
    }
    common
}
