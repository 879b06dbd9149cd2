//! Movements, turns and scales of objects of each kind, in the keys of their tables.

use glam::DVec3;
use rayfarm_tracer::scene::rotation;
use toml_edit::{Array, Item, TableLike, Value};

use super::document::put;

/// Moves an object along the axes of its group, or of the world.
///
/// # Errors
/// A group with a matrix, a table without the keys of its kind.
pub(super) fn translate(kind: &str, table: &mut dyn TableLike, by: DVec3) -> Result<(), String> {
    match kind {
        "model" | "group" => {
            refuse_matrix(table)?;
            refuse_keys(table, "translate")?;
            let from = vector(table, "translate")?.unwrap_or(DVec3::ZERO);
            put(table, "translate", array(from + by));
            move_key(table, "translate_end", by)
        }
        "sphere" => {
            refuse_keys(table, "center")?;
            move_required(table, "center", by)?;
            move_key(table, "center_end", by)
        }
        "disk" => move_required(table, "center", by),
        "plane" => move_required(table, "point", by),
        "box" => {
            move_required(table, "min", by)?;
            move_required(table, "max", by)
        }
        "triangle" => map_vertices(table, |vertex, _| vertex + by),
        "rectangle" => map_rectangle(table, |number, axis, _| number + by[axis]),
        other => Err(format!("a {other} cannot be moved")),
    }
}

/// Adds degrees about x, y and z to the rotation of an object, or turns its points about its centre.
///
/// # Errors
/// An object that has no rotation, a group with a matrix.
pub(super) fn rotate(kind: &str, table: &mut dyn TableLike, degrees: DVec3) -> Result<(), String> {
    match kind {
        "model" | "group" | "box" => {
            refuse_matrix(table)?;
            refuse_keys(table, "rotate")?;
            let from = vector(table, "rotate")?.unwrap_or(DVec3::ZERO);
            put(table, "rotate", array(from + degrees));
            move_key(table, "rotate_end", degrees)
        }
        "sphere" => {
            let from = vector(table, "uv_rotate")?.unwrap_or(DVec3::ZERO);
            put(table, "uv_rotate", array(from + degrees));
            Ok(())
        }
        "disk" | "plane" => {
            let normal = vector(table, "normal")?.ok_or("`normal` is missing")?;
            put(table, "normal", array(rotation::of_model(degrees) * normal));
            Ok(())
        }
        "triangle" => {
            let turn = rotation::of_model(degrees);
            map_vertices(table, |vertex, center| center + turn * (vertex - center))
        }
        _ => Err("a rectangle is across an axis and cannot be turned: put it into a [[group]]".to_owned()),
    }
}

/// Multiplies the size of an object along the axes, about its origin or centre.
///
/// # Errors
/// Factors that an object cannot have: different ones for a sphere or a disk; a plane.
pub(super) fn scale(kind: &str, table: &mut dyn TableLike, factors: DVec3) -> Result<(), String> {
    match kind {
        "model" | "group" => {
            refuse_matrix(table)?;
            refuse_keys(table, "scale")?;
            let from = match number(table, "scale") {
                Some(factor) => DVec3::splat(factor),
                None => vector(table, "scale")?.unwrap_or(DVec3::ONE),
            };
            put(table, "scale", factor_or_array(from * factors));
            Ok(())
        }
        "sphere" | "disk" => {
            if factors != DVec3::splat(factors.x) {
                return Err(format!("a {kind} has one radius: give one factor"));
            }
            refuse_keys(table, "radius")?;
            let radius = number(table, "radius").ok_or("`radius` is missing")?;
            put(table, "radius", Value::from(radius * factors.x));
            Ok(())
        }
        "box" => {
            let ends = [vector(table, "min")?, vector(table, "max")?];
            let [Some(lower), Some(upper)] = ends else { return Err("`min` or `max` is missing".to_owned()) };
            let center = lower * 0.5 + upper * 0.5;
            put(table, "min", array(center + (lower - center) * factors));
            put(table, "max", array(center + (upper - center) * factors));
            Ok(())
        }
        "triangle" => map_vertices(table, |vertex, center| center + (vertex - center) * factors),
        "rectangle" => {
            map_rectangle(table, |number, axis, middle| middle + (number - middle) * factors[axis])
        }
        _ => Err("a plane is infinite and has no size".to_owned()),
    }
}

fn refuse_matrix(table: &dyn TableLike) -> Result<(), String> {
    match table.get("matrix") {
        Some(_) => {
            Err("this group is placed by a `matrix`: change it with object set NAME matrix ...".to_owned())
        }
        None => Ok(()),
    }
}

/// Refuses to change a value that the keys of an animation replace: the change would have no effect.
fn refuse_keys(table: &dyn TableLike, key: &str) -> Result<(), String> {
    let is_keyed = match table.get("key") {
        Some(Item::ArrayOfTables(keys)) => keys.iter().any(|keys| keys.contains_key(key)),
        Some(Item::Value(Value::Array(keys))) => {
            keys.iter().filter_map(Value::as_inline_table).any(|keys| keys.contains_key(key))
        }
        _ => false,
    };
    match is_keyed {
        true => Err(format!("its keys have `{key}`: change them with object set NAME key ...")),
        false => Ok(()),
    }
}

fn move_required(table: &mut dyn TableLike, key: &str, by: DVec3) -> Result<(), String> {
    let from = vector(table, key)?.ok_or_else(|| format!("`{key}` is missing"))?;
    put(table, key, array(from + by));
    Ok(())
}

/// Adds to an optional vector.
fn move_key(table: &mut dyn TableLike, key: &str, by: DVec3) -> Result<(), String> {
    if let Some(from) = vector(table, key)? {
        put(table, key, array(from + by));
    }
    Ok(())
}

/// Maps the vertices of a triangle, each with the triangle's centre.
fn map_vertices(table: &mut dyn TableLike, map: impl Fn(DVec3, DVec3) -> DVec3) -> Result<(), String> {
    let missing = "`vertices` must be three points";
    let points = table.get("vertices").and_then(|item| item.as_array()).ok_or(missing)?;
    let points = points.iter().map(|value| value.as_array().and_then(vector_of));
    let points: Vec<DVec3> = points.collect::<Option<_>>().ok_or(missing)?;
    let center = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let mapped: Array = points.into_iter().map(|point| array(map(point, center))).collect();
    put(table, "vertices", Value::Array(mapped));
    Ok(())
}

/// Maps the coordinates of a rectangle, each with its axis and the middle of its range.
fn map_rectangle(table: &mut dyn TableLike, map: impl Fn(f64, usize, f64) -> f64) -> Result<(), String> {
    let axis = table.get("axis").and_then(|item| item.as_str()).ok_or("`axis` is missing")?;
    let (axis, others) = match axis {
        "x" => (0, [1, 2]),
        "y" => (1, [0, 2]),
        _ => (2, [0, 1]),
    };
    let at = number(table, "at").ok_or("`at` is missing")?;
    let ranges = table.get("ranges").and_then(|item| item.as_array()).ok_or("`ranges` is missing")?;
    let ranges: Vec<Vec<f64>> = ranges.iter().filter_map(Value::as_array).map(numbers_of).collect();
    let mapped: Array = ranges
        .iter()
        .zip(others)
        .map(|(range, axis)| {
            let middle = range.iter().sum::<f64>() / range.len().max(1) as f64;
            Value::Array(range.iter().map(|number| map(*number, axis, middle)).collect())
        })
        .collect();
    put(table, "at", Value::from(map(at, axis, at)));
    put(table, "ranges", Value::Array(mapped));
    Ok(())
}

fn number(table: &dyn TableLike, key: &str) -> Option<f64> {
    table.get(key)?.as_value().and_then(number_of)
}

fn number_of(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
}

/// The numbers of an array.
pub(super) fn numbers_of(array: &Array) -> Vec<f64> {
    array.iter().filter_map(number_of).collect()
}

fn vector_of(array: &Array) -> Option<DVec3> {
    match *numbers_of(array) {
        [x, y, z] if array.len() == 3 => Some(DVec3::new(x, y, z)),
        _ => None,
    }
}

fn vector(table: &dyn TableLike, key: &str) -> Result<Option<DVec3>, String> {
    let Some(item) = table.get(key) else { return Ok(None) };
    let vector = item.as_array().and_then(vector_of);
    vector.map(Some).ok_or_else(|| format!("`{key}` must be three numbers"))
}

fn array(vector: DVec3) -> Value {
    Value::Array(vector.to_array().into_iter().collect())
}

/// One number where all factors are equal.
fn factor_or_array(factors: DVec3) -> Value {
    if factors == DVec3::splat(factors.x) { Value::from(factors.x) } else { array(factors) }
}
