//! Typed values of the scene file. Each message has the expected and the actual value.

use std::ops::RangeInclusive;

use glam::{DVec2, DVec3, Vec2, Vec3};
use toml::Spanned;
use toml::de::DeValue;

use super::fault::{Fault, Read, shortened, suggestion};
use crate::scene::validate::MAX_COORDINATE;
use crate::texture::are_usable;

/// A remedy for back slashes in paths.
pub(super) const ESCAPES: &str = "a back slash in double quotes begins an escape: write / in paths, as in \
                                  \"models/new.obj\", or put them in 'single quotes'";

/// A value and the key it belongs to.
#[derive(Clone, Copy)]
pub(super) struct Value<'t> {
    /// Name of the key.
    pub(super) name: &'t str,
    /// The table of the key, as named in messages: `[camera]`.
    pub(super) owner: &'t str,
    /// The value itself.
    pub(super) value: &'t Spanned<DeValue<'t>>,
}

impl<'t> Value<'t> {
    /// Offset of the value in the text.
    pub(super) fn start(&self) -> usize {
        self.value.span().start
    }

    pub(super) fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::at_value(self.value, message)
    }

    /// A fault such as "`fov` in [camera] must be a number, but is "wide"".
    pub(super) fn must_be(&self, expected: &str) -> Fault {
        self.must_be_at(self.value, expected)
    }

    fn must_be_at(&self, culprit: &Spanned<DeValue<'_>>, expected: &str) -> Fault {
        let actual = describe(culprit.get_ref());
        Fault::at_value(culprit, format!("{self} must be {expected}, but is {actual}"))
    }

    pub(super) fn table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    /// A number within bounds that `expected` describes.
    pub(super) fn number(&self, expected: &str, fits: impl Fn(f64) -> bool) -> Read<f64> {
        let number = finite(self.value.get_ref()).filter(|n| fits(*n));
        number.ok_or_else(|| self.must_be(&format!("a number {expected}")))
    }

    /// A whole number within a range.
    pub(super) fn whole(&self, expected: &str, range: RangeInclusive<u32>) -> Read<u32> {
        let number = match self.value.get_ref() {
            DeValue::Integer(i) => u32::from_str_radix(i.as_str().trim_start_matches('+'), i.radix()).ok(),
            _ => None,
        };
        let number = number.filter(|n| range.contains(n));
        number.ok_or_else(|| self.must_be(&format!("a whole number {expected}")))
    }

    pub(super) fn boolean(&self) -> Read<bool> {
        self.value.get_ref().as_bool().ok_or_else(|| self.must_be("true or false"))
    }

    pub(super) fn text(&self) -> Read<&'t str> {
        self.value.get_ref().as_str().ok_or_else(|| self.must_be("a text in quotes"))
    }

    /// The name of a file. A back slash in double quotes may have become a line break, a tab or another control
    /// character.
    pub(super) fn file_name(&self, expected: &str) -> Read<&'t str> {
        let name = self.text()?;
        if name.is_empty() {
            return Err(self.must_be(expected));
        }
        if name.contains(char::is_control) {
            let name = shortened(name);
            let message = format!("{self} is \"{name}\", with characters that no file's name has; {ESCAPES}");
            return Err(self.fault(message));
        }
        Ok(name)
    }

    /// One of some words, as its value.
    pub(super) fn word<T: Copy>(&self, words: &[(&str, T)]) -> Read<T> {
        let known = words.iter().map(|(word, _)| *word);
        let text = self.value.get_ref().as_str().ok_or_else(|| {
            let list: Vec<String> = known.clone().map(|word| format!("\"{word}\"")).collect();
            self.must_be(&format!("one of {}", list.join(", ")))
        })?;
        words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning).ok_or_else(|| {
            let hint = suggestion(text, known, |list| format!("; known here: {list}"));
            self.fault(format!("unknown word `{}` for {self}{hint}", shortened(text)))
        })
    }

    /// Three numbers.
    pub(super) fn vector(&self) -> Read<DVec3> {
        let DeValue::Array(items) = self.value.get_ref() else {
            return Err(self.must_be("an array of three numbers"));
        };
        self.vector_of(self.value, items)
    }

    /// Three points of three numbers.
    pub(super) fn three_points(&self) -> Read<[DVec3; 3]> {
        let expected = "an array of three points";
        let DeValue::Array(items) = self.value.get_ref() else { return Err(self.must_be(expected)) };
        let [a, b, c] = items.iter().collect::<Vec<_>>()[..] else { return Err(self.must_be(expected)) };
        let point = |item: &'t Spanned<DeValue<'t>>| match item.get_ref() {
            DeValue::Array(items) => self.vector_of(item, items),
            _ => Err(self.must_be_at(item, expected)),
        };
        Ok([point(a)?, point(b)?, point(c)?])
    }

    /// Three pairs of texture coordinates.
    pub(super) fn three_uvs(&self) -> Read<[DVec2; 3]> {
        let expected = "an array of three pairs of finite numbers up to 1e6";
        let pairs = self.value.get_ref().as_array().and_then(|pairs| {
            <[DVec2; 3]>::try_from(pairs.iter().map(pair).collect::<Option<Vec<_>>>()?).ok()
        });
        pairs.filter(are_usable).ok_or_else(|| self.must_be(expected))
    }

    /// Two numbers up to `limit` in magnitude.
    pub(super) fn pair(&self, limit: f32) -> Read<Vec2> {
        let fits = |pair: &DVec2| pair.abs().cmple(DVec2::splat(f64::from(limit))).all();
        let expected = || format!("an array of two finite numbers up to {limit}");
        pair(self.value).filter(fits).map(|pair| pair.as_vec2()).ok_or_else(|| self.must_be(&expected()))
    }

    fn vector_of<'a>(
        &self,
        whole: &Spanned<DeValue<'_>>,
        items: impl IntoIterator<Item = &'a Spanned<DeValue<'t>>>,
    ) -> Read<DVec3>
    where
        't: 'a,
    {
        let [x, y, z] = items.into_iter().collect::<Vec<_>>()[..] else {
            return Err(self.must_be_at(whole, "an array of three numbers"));
        };
        let coordinate = |item: &Spanned<DeValue<'_>>| {
            let number = finite(item.get_ref()).filter(|n| n.abs() <= MAX_COORDINATE);
            number.ok_or_else(|| self.must_be_at(item, "made of finite numbers up to 1e30"))
        };
        Ok(DVec3::new(coordinate(x)?, coordinate(y)?, coordinate(z)?))
    }

    /// Three numbers, normalised; not zero.
    pub(super) fn direction(&self) -> Read<DVec3> {
        unit(self.vector()?).ok_or_else(|| self.must_be("a direction, not zero"))
    }

    /// The entries of an array, each as a value of the same key.
    pub(super) fn items(&self, expected: &str) -> Read<Vec<Value<'t>>> {
        match self.value.get_ref() {
            DeValue::Array(items) => Ok(items.iter().map(|value| Value { value, ..*self }).collect()),
            _ => Err(self.must_be(expected)),
        }
    }

    /// The entries of an array of a fixed length.
    pub(super) fn array<const N: usize>(&self, expected: &str) -> Read<[Value<'t>; N]> {
        <[Value<'t>; N]>::try_from(self.items(expected)?).map_err(|_| self.must_be(expected))
    }

    /// A finite number up to 1e30 in magnitude.
    pub(super) fn coordinate(&self) -> Read<f64> {
        self.number("that is finite and up to 1e30", |n| n.abs() <= MAX_COORDINATE)
    }

    /// Factors along three axes, none of them zero.
    pub(super) fn scale(&self) -> Read<DVec3> {
        let expected = "one number, or three in an array, none of them 0";
        let scale = if self.value.get_ref().is_array() {
            self.vector()?
        } else {
            let fits = |n: f64| n.abs() <= MAX_COORDINATE;
            DVec3::splat(self.number("(or an array of three), not 0 and up to 1e30", fits)?)
        };
        let flat = scale.to_array().contains(&0.0);
        if flat { Err(self.must_be(expected)) } else { Ok(scale) }
    }

    /// A number above 0 and up to 1e30.
    pub(super) fn positive(&self) -> Read<f64> {
        self.number("above 0", |n| n > 0.0 && n <= MAX_COORDINATE)
    }

    /// A share of light: a colour with channels from 0 to 1, or one number for all three.
    pub(super) fn share(&self) -> Read<Vec3> {
        if self.value.get_ref().is_array() {
            return self.color(1.0);
        }
        let fits = |n: f64| (0.0..=1.0).contains(&n);
        self.number("from 0 to 1, or a colour", fits).map(|n| Vec3::splat(n as f32))
    }

    /// Three numbers from 0 to `limit`, linear RGB.
    pub(super) fn color(&self, limit: f32) -> Read<Vec3> {
        let color = self.vector()?;
        let fits = color.to_array().iter().all(|c| (0.0..=f64::from(limit)).contains(c));
        fits.then(|| color.as_vec3())
            .ok_or_else(|| self.must_be(&format!("a colour with channels from 0 to {limit}")))
    }
}

impl std::fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` in {}", self.name, self.owner)
    }
}

/// A normalised vector; `None` for zero. It is first scaled by a power of two, so that no square underflows or
/// overflows.
pub(super) fn unit(vector: DVec3) -> Option<DVec3> {
    let (_, exponent) = libm::frexp(vector.abs().max_element());
    let scaled = DVec3::from_array(vector.to_array().map(|c| libm::ldexp(c, -exponent)));
    let length = scaled.length();
    (length > 0.0).then(|| scaled / length)
}

/// Two finite numbers.
fn pair(item: &Spanned<DeValue<'_>>) -> Option<DVec2> {
    let numbers = item.get_ref().as_array()?.iter().map(|item| finite(item.get_ref()));
    <[f64; 2]>::try_from(numbers.collect::<Option<Vec<_>>>()?).ok().map(DVec2::from_array)
}

/// A number that is neither infinite nor NaN.
fn finite(value: &DeValue<'_>) -> Option<f64> {
    let number: f64 = match value {
        DeValue::Float(f) => f.as_str().parse().ok()?,
        DeValue::Integer(i) if i.radix() == 10 => i.as_str().parse().ok()?,
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok()? as f64,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("\"{}\"", shortened(text)),
        DeValue::Integer(number) => shortened(&number.to_string()),
        DeValue::Float(number) => shortened(number.as_str()),
        DeValue::Boolean(boolean) => boolean.to_string(),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(items) => match numbers(items.iter()) {
            Some(list) => list,
            None => format!("an array of {}", items.iter().count()),
        },
        DeValue::Table(_) => "a table".into(),
    }
}

/// A short array of numbers as written in the file.
fn numbers<'a, 'i: 'a>(items: impl Iterator<Item = &'a Spanned<DeValue<'i>>>) -> Option<String> {
    let items: Vec<String> = items
        .map(|item| match item.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => Some(describe(item.get_ref())),
            _ => None,
        })
        .take(5)
        .collect::<Option<_>>()?;
    (items.len() < 5).then(|| format!("[{}]", items.join(", ")))
}
