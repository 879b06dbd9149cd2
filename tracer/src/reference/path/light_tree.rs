//! One of many lights, by the light that each can send to a point: see `light::table::tree`, whose layout is used.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::sources::Among;
use crate::light::table::{LEAST_COSINE, LEAST_DISTANCE, Layout, MIN_LIGHTS};

/// A point that gets light, and its normal.
#[derive(Clone, Copy)]
pub(super) struct Receiver {
    pub position: DVec3,
    pub normal: DVec3,
}

/// A light, or several that are together.
#[derive(Clone)]
pub(super) struct Lamp {
    pub lo: DVec3,
    pub hi: DVec3,
    pub center: DVec3,
    pub radius: f64,
    pub axis: DVec3,
    /// Largest angle between the axis and a normal, and between a normal and light.
    pub angles: [f64; 2],
    /// Irradiance: a share that falls with the square of the distance, and one that does not.
    pub irradiance: [f64; 2],
    /// The same of those with an extent.
    pub with_extent: [f64; 2],
}

/// Many lights.
pub(super) struct LightTree {
    /// Index of each light among the sources.
    pub sources: Vec<usize>,
    layout: Layout,
    /// The parts of each node.
    nodes: Vec<Vec<Lamp>>,
    least_distance: f64,
}

impl Lamp {
    /// A triangle that shines from its front.
    pub(super) fn triangle(corners: [DVec3; 3], front: DVec3, radiance: f64) -> Self {
        let [a, b, c] = corners;
        let center = (a + b + c) / 3.0;
        let radius = a.distance(center).max(b.distance(center)).max(c.distance(center));
        let irradiance = [radiance * (b - a).cross(c - a).length() / 2.0, 0.0];
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let angles = [0.0, FRAC_PI_2];
        Self { lo, hi, center, radius, axis: front, angles, irradiance, with_extent: irradiance }
    }

    /// A ball or a point that shines to all sides.
    pub(super) fn ball(center: DVec3, radius: f64, irradiance: [f64; 2]) -> Self {
        let (lo, hi) = (center - radius, center + radius);
        let with_extent = if radius > 0.0 { irradiance } else { [0.0; 2] };
        Self { lo, hi, center, radius, axis: DVec3::Z, angles: [PI, 0.0], irradiance, with_extent }
    }

    fn together(lamps: &[&Self]) -> Self {
        let lo = lamps.iter().fold(DVec3::INFINITY, |lo, lamp| lo.min(lamp.lo));
        let hi = lamps.iter().fold(DVec3::NEG_INFINITY, |hi, lamp| hi.max(lamp.hi));
        let center = (lo + hi) / 2.0;
        let around = lamps.iter().map(|lamp| lamp.center.distance(center) + lamp.radius);
        let radius = around.fold(0.0, f64::max).min(lo.distance(hi) / 2.0);
        let sum: DVec3 = lamps.iter().map(|lamp| lamp.axis).sum();
        let everywhere = lamps.iter().any(|lamp| lamp.angles[0] >= PI);
        let (axis, spread) = if everywhere || sum.length() < 1e-6 * lamps.len() as f64 {
            (DVec3::Z, PI)
        } else {
            let axis = sum.normalize();
            let spreads = lamps.iter().map(|lamp| axis.angle_between(lamp.axis) + lamp.angles[0]);
            (axis, spreads.fold(0.0, f64::max).min(PI))
        };
        let emission = lamps.iter().map(|lamp| lamp.angles[1]).fold(0.0, f64::max);
        let sum_of = |of: fn(&Self) -> [f64; 2]| {
            lamps.iter().map(|lamp| of(lamp)).fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
        };
        let (irradiance, with_extent) = (sum_of(|lamp| lamp.irradiance), sum_of(|lamp| lamp.with_extent));
        Self { lo, hi, center, radius, axis, angles: [spread, emission], irradiance, with_extent }
    }

    /// Up to a factor, the most light that a point may get.
    fn importance(&self, among: Among, to: &Receiver, least_distance: f64) -> f64 {
        let [falling, constant] = match among {
            Among::All => self.irradiance,
            Among::WithExtent => self.with_extent,
        };
        let way = self.center - to.position;
        let distance = way.length();
        let near = distance.max(self.radius).max(least_distance);
        let most = falling / (near * near) + constant;
        if distance <= self.radius {
            return most;
        }
        let sphere = libm::asin(self.radius / distance);
        let leaving = (self.axis.angle_between(-way) - self.angles[0]).max(0.0) - sphere;
        let arriving = to.normal.angle_between(way) - sphere;
        let [leaving, arriving] = [leaving, arriving].map(|angle| libm::cos(angle.max(0.0)));
        let least = f64::from(LEAST_COSINE);
        if leaving > libm::cos(self.angles[1]) - least && arriving > -least {
            most * leaving.max(least) * arriving.max(least)
        } else {
            0.0
        }
    }
}

impl LightTree {
    /// The tree of lights, with their indices among the sources; `None` if they are few.
    pub(super) fn of(lights: Vec<(usize, Lamp)>, reach: f64) -> Option<Self> {
        if lights.len() < MIN_LIGHTS {
            return None;
        }
        let (sources, lamps): (Vec<usize>, Vec<Lamp>) = lights.into_iter().unzip();
        let layout = Layout::new(&lamps.iter().map(|lamp| lamp.center).collect::<Vec<_>>());
        let nodes = layout.nodes.iter().map(|parts| {
            let lamps = parts.iter().map(|part| {
                let members = layout.order[part.lights.clone()].iter();
                let members: Vec<&Lamp> = members.map(|&light| &lamps[light as usize]).collect();
                if let [one] = members[..] { one.clone() } else { Lamp::together(&members) }
            });
            lamps.collect()
        });
        let nodes = nodes.collect();
        Some(Self { sources, layout, nodes, least_distance: reach * LEAST_DISTANCE })
    }

    /// The source that a point selects by a number in [0, 1), and its probability.
    pub(super) fn select(&self, among: Among, to: &Receiver, mut number: f64) -> Option<(usize, f64)> {
        let (mut node, mut probability) = (0, 1.0);
        loop {
            let shares = self.shares(node, among, to)?;
            let mut part = 0;
            while number >= shares[part] && part + 1 < shares.len() {
                number -= shares[part];
                part += 1;
            }
            probability *= shares[part];
            number /= shares[part];
            let Some(next) = self.layout.nodes[node][part].node else {
                let light = self.layout.order[self.layout.nodes[node][part].lights.start];
                return Some((self.sources[light as usize], probability));
            };
            node = next as usize;
        }
    }

    /// The probability with which a point selects a source.
    pub(super) fn probability(&self, among: Among, to: &Receiver, source: usize) -> f64 {
        let is_source = |&light: &u32| self.sources[light as usize] == source;
        let Some(place) = self.layout.order.iter().position(is_source) else { return 0.0 };
        let (mut node, mut probability) = (0, 1.0);
        loop {
            let parts = &self.layout.nodes[node];
            let Some(part) = parts.iter().position(|part| part.lights.contains(&place)) else { return 0.0 };
            let Some(shares) = self.shares(node, among, to) else { return 0.0 };
            probability *= shares[part];
            let Some(next) = parts[part].node else { return probability };
            node = next as usize;
        }
    }

    /// Probabilities of the parts of a node; `None` if none of them reaches the point.
    fn shares(&self, node: usize, among: Among, to: &Receiver) -> Option<Vec<f64>> {
        let importances = self.nodes[node].iter().map(|lamp| lamp.importance(among, to, self.least_distance));
        let importances: Vec<f64> = importances.collect();
        let total: f64 = importances.iter().sum();
        (total > 0.0).then(|| importances.iter().map(|importance| importance / total).collect())
    }
}
