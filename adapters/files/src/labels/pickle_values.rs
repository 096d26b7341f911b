//! What a pickle of labels can hold.

use super::ndarray::Dtype;

/// A value; what does not fit a word is an object of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    /// Position among the objects.
    Object(usize),
}

/// What a [`Value::Object`] refers to.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Object {
    Text(String),
    /// Bytes, and the text of Python 2, which does not tell them apart.
    Bytes(Vec<u8>),
    Tuple(Vec<Value>),
    List(Vec<Value>),
    Dict(Vec<(Value, Value)>),
    Dtype(Dtype),
    /// An array's type and the object that holds its bytes; `None` until its state is set.
    Array(Option<(Dtype, usize)>),
    Name(Name),
}

/// The functions and classes that may be named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Name {
    Reconstruct,
    FromBuffer,
    Scalar,
    Dtype,
    Encode,
    Bytes,
    Dict,
    /// A class that is only handed to others.
    Class,
}

impl Name {
    /// The one that a pickle names, where it is one of these.
    pub(super) fn find(module: &str, name: &str) -> Option<Self> {
        // NumPy 2 renamed `numpy.core` to `numpy._core`.
        let module = module.replace("numpy._core", "numpy.core");
        match (module.as_str(), name) {
            ("numpy.core.multiarray", "_reconstruct") => Some(Self::Reconstruct),
            ("numpy.core.multiarray", "scalar") => Some(Self::Scalar),
            ("numpy.core.numeric", "_frombuffer") => Some(Self::FromBuffer),
            ("numpy", "dtype") => Some(Self::Dtype),
            ("_codecs", "encode") => Some(Self::Encode),
            ("builtins" | "__builtin__", "bytes" | "bytearray") => Some(Self::Bytes),
            ("builtins" | "__builtin__", "dict") | ("collections", "OrderedDict" | "defaultdict") => {
                Some(Self::Dict)
            }
            ("numpy", "ndarray") | ("builtins" | "__builtin__", "int" | "float" | "list") => {
                Some(Self::Class)
            }
            _ => None,
        }
    }
}

/// The objects of a pickle that was read to its end, and the value it stands for.
pub(super) struct Unpickled {
    /// All objects, in the order in which they were made.
    pub(super) objects: Vec<Object>,
    /// What the pickle stands for.
    pub(super) top: Value,
}

impl Unpickled {
    /// The object that a value refers to.
    pub(super) fn object(&self, value: Value) -> Option<&Object> {
        match value {
            Value::Object(at) => self.objects.get(at),
            _ => None,
        }
    }

    /// Type and bytes of an array.
    pub(super) fn array(&self, value: Value) -> Option<(Dtype, &[u8])> {
        match self.object(value)? {
            Object::Array(Some((dtype, data))) => match self.objects.get(*data)? {
                Object::Bytes(bytes) => Some((*dtype, bytes)),
                _ => None,
            },
            _ => None,
        }
    }
}
