//! A machine for Python pickles that knows dictionaries, numbers, text and NumPy arrays, and nothing else.
//!
//! Python's own machine calls whatever function a pickle names. This one calls nothing: a name that is not on its list
//! is an error. Values live in one flat list and refer to each other by index, so that neither deep nesting nor shared
//! or circular references can exhaust the stack, and memory stays in proportion to the bytes read.
//!
//! The crate serde-pickle calls nothing either, but keeps only the last state of an object: the element type of an
//! array is lost where it is first used, and what an array refers to twice comes back empty.

use std::collections::BTreeMap;

use vice_core::error::{DataError, DataResult};

use super::ndarray::Dtype;
use super::pickle_text::{raw_unicode, unescape};
use super::pickle_values::{Name, Object, Unpickled, Value};

/// Reads a pickle of protocol 0 to 5.
///
/// # Errors
/// [`DataError`] with the byte for a pickle that is cut off, broken, or names anything beyond dictionaries and arrays.
pub(super) fn unpickle(bytes: &[u8]) -> DataResult<Unpickled> {
    let mut machine = Machine {
        bytes,
        at: 0,
        stack: Vec::new(),
        marks: Vec::new(),
        memo: BTreeMap::new(),
        objects: Vec::new(),
        copied: 0,
    };
    loop {
        let start = machine.at;
        match machine.step() {
            Ok(None) => {}
            Ok(Some(top)) => return Ok(Unpickled { objects: machine.objects, top }),
            Err(problem) => return Err(DataError::new(problem).byte(start as u64)),
        }
    }
}

type Step<T> = Result<T, String>;

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Value>,
    marks: Vec<usize>,
    memo: BTreeMap<u64, Value>,
    objects: Vec<Object>,
    /// Bytes copied from objects that may be shared: bounded, since a few bytes can ask for a copy of many.
    copied: usize,
}

impl Machine<'_> {
    /// Does one operation; gives the result at the end of the pickle.
    fn step(&mut self) -> Step<Option<Value>> {
        let operation = self.take(1)?[0];
        match operation {
            b'.' => return self.pop().map(Some),
            0x80 => drop(self.take(1)?),
            0x95 => drop(self.take(8)?),
            b'(' => self.marks.push(self.stack.len()),
            b'0' => drop(self.pop()?),
            b'1' => drop(self.pop_to_mark()?),
            b'2' => {
                let top = self.top()?;
                self.stack.push(top);
            }
            b'N' => self.stack.push(Value::None),
            0x88 => self.stack.push(Value::Bool(true)),
            0x89 => self.stack.push(Value::Bool(false)),
            b'I' | b'L' | b'F' | b'J' | b'K' | b'M' | b'G' | 0x8a | 0x8b => {
                let number = self.number(operation)?;
                self.stack.push(number);
            }
            b'S' | b'V' | b'T' | b'U' | b'X' | b'B' | b'C' | 0x8c | 0x8d | 0x8e | 0x96 => {
                let text = self.text(operation)?;
                self.push_object(text);
            }
            b'p' | b'q' | b'r' | 0x94 => {
                let key = match operation {
                    0x94 => self.memo.len() as u64,
                    _ => self.memo_key(operation)?,
                };
                let top = self.top()?;
                self.memo.insert(key, top);
            }
            b'g' | b'h' | b'j' => {
                let key = self.memo_key(operation)?;
                let value = *self.memo.get(&key).ok_or_else(|| format!("nothing was kept as {key}"))?;
                self.stack.push(value);
            }
            // A buffer that is read-only is a buffer.
            0x98 => {}
            b')' => self.push_object(Object::Tuple(Vec::new())),
            b']' => self.push_object(Object::List(Vec::new())),
            b'}' => self.push_object(Object::Dict(Vec::new())),
            0x85..=0x87 => {
                let n = usize::from(operation - 0x84);
                let from = self.stack.len().checked_sub(n).ok_or_else(underflow)?;
                let items = self.stack.split_off(from);
                self.push_object(Object::Tuple(items));
            }
            b't' | b'l' => {
                let items = self.pop_to_mark()?;
                self.push_object(if operation == b't' { Object::Tuple(items) } else { Object::List(items) });
            }
            b'd' => {
                let items = self.pop_to_mark()?;
                self.push_object(Object::Dict(pairs(&items)?));
            }
            b'a' | b'e' => {
                let items = if operation == b'a' { vec![self.pop()?] } else { self.pop_to_mark()? };
                match self.top_object()? {
                    Object::List(list) => list.extend(items),
                    _ => return Err("items are appended to what is no list".into()),
                }
            }
            b's' | b'u' => {
                let items = if operation == b's' {
                    let value = self.pop()?;
                    vec![self.pop()?, value]
                } else {
                    self.pop_to_mark()?
                };
                let items = pairs(&items)?;
                match self.top_object()? {
                    Object::Dict(dict) => dict.extend(items),
                    _ => return Err("items are set in what is no dictionary".into()),
                }
            }
            b'c' => {
                let (module, name) = (self.line()?, self.line()?);
                self.push_name(&module, &name)?;
            }
            0x93 => {
                let (name, module) = (self.pop()?, self.pop()?);
                let (module, name) = (self.text_of(module)?, self.text_of(name)?);
                self.push_name(&module, &name)?;
            }
            b'R' => self.reduce()?,
            b'b' => self.build()?,
            0x97 => return Err("the arrays were stored outside of the pickle".into()),
            other => return Err(format!("operation {other:#04x} is nothing that labels need")),
        }
        Ok(None)
    }

    fn number(&mut self, operation: u8) -> Step<Value> {
        Ok(match operation {
            b'I' => match self.line()?.as_str() {
                "00" => Value::Bool(false),
                "01" => Value::Bool(true),
                text => Value::Int(text.parse().map_err(|_| format!("`{text}` is no integer"))?),
            },
            b'L' => {
                let text = self.line()?;
                Value::Int(text.trim_end_matches('L').parse().map_err(|_| format!("`{text}` is no integer"))?)
            }
            b'F' => {
                let text = self.line()?;
                Value::Float(text.parse().map_err(|_| format!("`{text}` is no number"))?)
            }
            b'J' => Value::Int(i64::from(i32::from_le_bytes(self.array()?))),
            b'K' => Value::Int(i64::from(self.take(1)?[0])),
            b'M' => Value::Int(i64::from(u16::from_le_bytes(self.array()?))),
            b'G' => Value::Float(f64::from_be_bytes(self.array()?)),
            _ => {
                let size = if operation == 0x8a { self.length(1)? } else { self.length(4)? };
                let bytes = self.take(size)?;
                if bytes.len() > 8 {
                    return Err("an integer does not fit 64 bits".into());
                }
                let negative = bytes.last().is_some_and(|b| b & 0x80 != 0);
                let mut wide = [if negative { 0xff } else { 0 }; 8];
                wide[..bytes.len()].copy_from_slice(bytes);
                Value::Int(i64::from_le_bytes(wide))
            }
        })
    }

    fn text(&mut self, operation: u8) -> Step<Object> {
        let size = match operation {
            b'S' => return unescape(&self.line()?).map(Object::Bytes),
            b'V' => return raw_unicode(&self.line()?).map(Object::Text),
            b'C' | b'U' | 0x8c => self.length(1)?,
            b'B' | b'T' | b'X' => self.length(4)?,
            _ => self.length(8)?,
        };
        let bytes = self.take(size)?.to_vec();
        match operation {
            b'X' | 0x8c | 0x8d => {
                String::from_utf8(bytes).map(Object::Text).map_err(|_| "text is not UTF-8".to_string())
            }
            _ => Ok(Object::Bytes(bytes)),
        }
    }

    /// Calls a function, as far as labels need one.
    fn reduce(&mut self) -> Step<()> {
        let (arguments, function) = (self.pop()?, self.pop()?);
        let Object::Tuple(arguments) = self.get(arguments)? else {
            return Err("a call has no arguments".into());
        };
        let arguments = arguments.clone();
        self.copied += arguments.len() * size_of::<Value>();
        let Object::Name(name) = *self.get(function)? else {
            return Err("what is called is no function".into());
        };
        let argument = |i: usize| arguments.get(i).copied().ok_or("a call has too few arguments".to_string());
        match name {
            Name::Reconstruct => self.push_object(Object::Array(None)),
            Name::Dtype => {
                let code = self.text_of(argument(0)?)?;
                let dtype = Dtype::from_code(&code).ok_or_else(|| {
                    format!("arrays of `{code}` are no pixels: float or integer is expected")
                })?;
                self.push_object(Object::Dtype(dtype));
            }
            Name::FromBuffer => {
                let (data, dtype) = (argument(0)?, argument(1)?);
                let array = (self.dtype_of(dtype)?, self.bytes_at(data)?);
                self.push_object(Object::Array(Some(array)));
            }
            Name::Scalar => {
                let (dtype, data) = (self.dtype_of(argument(0)?)?, self.bytes_at(argument(1)?)?);
                let Object::Bytes(bytes) = &self.objects[data] else {
                    return Err("a number has no bytes".into());
                };
                let value = if dtype.is_bool() {
                    dtype.integer(bytes, 0).map(|i| Value::Bool(i != 0))
                } else if dtype.is_integer() {
                    dtype.integer(bytes, 0).map(Value::Int)
                } else {
                    dtype.float(bytes, 0).map(Value::Float)
                };
                self.stack.push(value.ok_or("a number is cut off")?);
            }
            Name::Encode => {
                let text = self.text_of(argument(0)?)?;
                let bytes = text.chars().map(|c| u8::try_from(c as u32)).collect::<Result<Vec<u8>, _>>();
                self.push_object(Object::Bytes(bytes.map_err(|_| "text is not Latin-1")?));
            }
            Name::Bytes => match arguments.first() {
                None => self.push_object(Object::Bytes(Vec::new())),
                Some(value) => {
                    let at = self.bytes_at(*value)?;
                    self.stack.push(Value::Object(at));
                }
            },
            Name::Dict => self.push_object(Object::Dict(Vec::new())),
            Name::Class => return Err("a class is called that labels do not need".into()),
        }
        // Copies of what is shared could grow with the square of the file.
        if self.copied > 4 * self.bytes.len() + 4096 {
            return Err("the pickle copies the same bytes over and over".into());
        }
        Ok(())
    }

    /// Sets the state of an array or of its type.
    fn build(&mut self) -> Step<()> {
        let state = self.pop()?;
        let Object::Tuple(state) = self.get(state)? else { return Err("a state is no tuple".into()) };
        let item = |i: usize| state.get(i).copied().ok_or("a state is too short".to_string());
        match self.top()? {
            Value::Object(at) => match &self.objects[at] {
                Object::Dtype(dtype) => {
                    let (dtype, order) = (*dtype, self.text_of_shared(item(1)?)?);
                    let dtype = dtype.with_order(order).ok_or("an unknown byte order")?;
                    self.objects[at] = Object::Dtype(dtype);
                }
                Object::Array(_) => {
                    let array = (self.dtype_of(item(2)?)?, self.bytes_at(item(4)?)?);
                    self.objects[at] = Object::Array(Some(array));
                }
                _ => return Err("a state is set for what has none".into()),
            },
            _ => return Err("a state is set for what has none".into()),
        }
        Ok(())
    }

    fn push_name(&mut self, module: &str, name: &str) -> Step<()> {
        let name = Name::find(module, name).ok_or_else(|| {
            format!("the pickle asks for {module}.{name}; only dictionaries and NumPy arrays are read, nothing is run")
        })?;
        self.push_object(Object::Name(name));
        Ok(())
    }

    fn push_object(&mut self, object: Object) {
        self.stack.push(Value::Object(self.objects.len()));
        self.objects.push(object);
    }

    fn get(&self, value: Value) -> Step<&Object> {
        match value {
            Value::Object(at) => Ok(&self.objects[at]),
            _ => Err("a plain value stands where an object is expected".into()),
        }
    }

    fn text_of_shared(&self, value: Value) -> Step<&str> {
        match self.get(value)? {
            Object::Text(text) => Ok(text),
            Object::Bytes(bytes) => std::str::from_utf8(bytes).map_err(|_| "a name is no text".into()),
            _ => Err("text is expected".into()),
        }
    }

    fn text_of(&mut self, value: Value) -> Step<String> {
        let text = self.text_of_shared(value)?.to_string();
        self.copied += text.len();
        Ok(text)
    }

    fn dtype_of(&self, value: Value) -> Step<Dtype> {
        match self.get(value)? {
            Object::Dtype(dtype) => Ok(*dtype),
            _ => Err("an array has no type".into()),
        }
    }

    fn bytes_at(&self, value: Value) -> Step<usize> {
        match (value, self.get(value)?) {
            (Value::Object(at), Object::Bytes(_)) => Ok(at),
            _ => Err("an array has no bytes".into()),
        }
    }

    fn top(&self) -> Step<Value> {
        self.stack.last().copied().ok_or_else(underflow)
    }

    fn top_object(&mut self) -> Step<&mut Object> {
        match self.top()? {
            Value::Object(at) => Ok(&mut self.objects[at]),
            _ => Err("a plain value stands where an object is expected".into()),
        }
    }

    fn pop(&mut self) -> Step<Value> {
        self.stack.pop().ok_or_else(underflow)
    }

    fn pop_to_mark(&mut self) -> Step<Vec<Value>> {
        match self.marks.pop() {
            Some(mark) if mark <= self.stack.len() => Ok(self.stack.split_off(mark)),
            _ => Err(underflow()),
        }
    }

    fn take(&mut self, n: usize) -> Step<&[u8]> {
        let end = self.at.checked_add(n).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or("the pickle is cut off")?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Step<[u8; N]> {
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N)?);
        Ok(bytes)
    }

    /// A length of so many bytes, lowest first.
    fn length(&mut self, size: usize) -> Step<usize> {
        let mut wide = [0; 8];
        wide[..size].copy_from_slice(self.take(size)?);
        usize::try_from(u64::from_le_bytes(wide)).map_err(|_| "a length is out of range".into())
    }

    fn memo_key(&mut self, operation: u8) -> Step<u64> {
        match operation {
            b'q' | b'h' => self.length(1).map(|key| key as u64),
            b'r' | b'j' => self.length(4).map(|key| key as u64),
            _ => {
                let text = self.line()?;
                text.parse().map_err(|_| format!("`{text}` is no place to keep a value"))
            }
        }
    }

    fn line(&mut self) -> Step<String> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| *b == b'\n').ok_or("the pickle is cut off")?;
        let line = rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]);
        // Text of protocol 0 is Latin-1.
        let line = line.iter().map(|b| char::from(*b)).collect();
        self.at += end + 1;
        Ok(line)
    }
}

fn underflow() -> String {
    "an operation finds too few values".into()
}

fn pairs(items: &[Value]) -> Step<Vec<(Value, Value)>> {
    if items.len() % 2 == 1 {
        return Err("a key has no value".into());
    }
    Ok(items.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect())
}
