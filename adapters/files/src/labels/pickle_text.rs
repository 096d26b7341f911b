//! Text of the oldest pickle protocol, which is printable.

/// The text of Python 2 in protocol 0: quoted, with escapes, one char a byte.
pub(super) fn unescape(quoted: &str) -> Result<Vec<u8>, String> {
    let broken = || "quoted text is broken".to_string();
    let quote = quoted.chars().next().filter(|c| matches!(c, '\'' | '"')).ok_or_else(broken)?;
    let inner = quoted[1..].strip_suffix(quote).ok_or_else(broken)?;
    let mut bytes = Vec::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        let code = if c != '\\' {
            c as u32
        } else {
            match chars.next().ok_or_else(broken)? {
                'n' => 10,
                'r' => 13,
                't' => 9,
                'x' => hexadecimal(&mut chars, 2)?,
                other => other as u32,
            }
        };
        bytes.push(u8::try_from(code).map_err(|_| broken())?);
    }
    Ok(bytes)
}

/// The text of protocol 0: `\uXXXX` escapes, everything else as it is.
pub(super) fn raw_unicode(line: &str) -> Result<String, String> {
    let mut text = String::with_capacity(line.len());
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        let mut ahead = chars.clone();
        let size = match (c, ahead.next()) {
            ('\\', Some('u')) => 4,
            ('\\', Some('U')) => 8,
            _ => {
                text.push(c);
                continue;
            }
        };
        let code = hexadecimal(&mut ahead, size)?;
        text.push(char::from_u32(code).ok_or("an escape is no character")?);
        chars = ahead;
    }
    Ok(text)
}

fn hexadecimal(chars: &mut std::str::Chars<'_>, digits: usize) -> Result<u32, String> {
    let mut value = 0;
    for _ in 0..digits {
        let digit = chars.next().and_then(|c| c.to_digit(16)).ok_or("an escape is broken")?;
        value = value * 16 + digit;
    }
    Ok(value)
}
