//! Loads pairs of bodies into lanes, and makes collisions of the results.

use zynq_pgs::{Body, CONTACT_POINTS, Collision, Contact};

use super::super::Geometries;
use super::super::boxes::{self, Placed};
use super::super::lanes::{self, LANES_MAX, Lanes, Mask, Numbers, Rotation, Row, Vector};
use super::super::parry::Parry;
use super::super::points::Points;
use super::super::reduce::reduce;
use crate::Geometry;

/// Tolerance of a normal's length: rounding is far below, a broken pose above.
const NORMAL_TOLERANCE: f32 = 5e-4;

/// One body of each pair in a batch.
#[derive(Debug, Default)]
struct Side {
    position: [Row; 3],
    orientation: [Row; 4],
    half_extents: [Row; 3],
}

impl Side {
    #[inline(always)]
    fn set(&mut self, lane: usize, body: &Body, geometry: Geometry) -> bool {
        for (row, number) in self.position.iter_mut().zip(body.pose.position) {
            row.0[lane] = number;
        }
        for (row, number) in self.orientation.iter_mut().zip(body.pose.orientation) {
            row.0[lane] = number;
        }
        // Other bodies than boxes enter the lanes as boxes without a size, whose results are
        // ignored.
        let (half_extents, is_box) = match geometry {
            Geometry::Box { half_extents } => (half_extents, true),
            _ => ([0.0; 3], false),
        };
        for (row, number) in self.half_extents.iter_mut().zip(half_extents) {
            row.0[lane] = number;
        }
        is_box
    }

    #[inline(always)]
    fn load<L: Lanes>(&self, lanes: L) -> Loaded<L::Numbers> {
        let ([px, py, pz], [hx, hy, hz]) = (&self.position, &self.half_extents);
        let [x, y, z, w] = &self.orientation;
        Loaded {
            position: Vector { x: lanes.load(px), y: lanes.load(py), z: lanes.load(pz) },
            axis: Vector { x: lanes.load(x), y: lanes.load(y), z: lanes.load(z) },
            w: lanes.load(w),
            half_extents: Vector { x: lanes.load(hx), y: lanes.load(hy), z: lanes.load(hz) },
        }
    }
}

/// The bodies in lanes; the orientation as a quaternion's axis and w.
struct Loaded<N> {
    position: Vector<N>,
    axis: Vector<N>,
    w: N,
    half_extents: Vector<N>,
}

/// Pairs, one in each lane.
#[derive(Debug, Default)]
pub(super) struct Batch {
    pairs: [(u32, u32); LANES_MAX],
    geometries: [Option<[Geometry; 2]>; LANES_MAX],
    count: usize,
    /// The lanes in which both bodies are boxes.
    boxes: u32,
    a: Side,
    b: Side,
}

impl Batch {
    /// Loads the next pairs, up to the number of lanes.
    #[inline(always)]
    pub(super) fn take(
        &mut self,
        lanes: usize,
        pairs: &mut impl Iterator<Item = (u32, u32)>,
        bodies: &[Body],
        geometries: Geometries<'_>,
    ) {
        (self.count, self.boxes) = (0, 0);
        while self.count < lanes.min(LANES_MAX) {
            let Some((a, b)) = pairs.next() else { break };
            let (Some(body_a), Some(body_b)) = (bodies.get(a as usize), bodies.get(b as usize))
            else {
                continue;
            };
            let (Some(of_a), Some(of_b)) = (geometries.of(body_a), geometries.of(body_b)) else {
                continue;
            };
            let lane = self.count;
            let are_boxes = self.a.set(lane, body_a, of_a) & self.b.set(lane, body_b, of_b);
            self.boxes |= u32::from(are_boxes) << lane;
            self.pairs[lane] = (a, b);
            self.geometries[lane] = Some([of_a, of_b]);
            self.count += 1;
        }
    }

    /// Whether no pair was left to load.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds the collisions of the pairs.
    #[inline(always)]
    pub(super) fn collide<L: Lanes>(
        &self,
        lanes: L,
        parry: &mut Parry,
        points: &mut Points<L::Numbers>,
        bodies: &[Body],
        found: &mut Vec<Collision>,
    ) {
        let (a, b) = (self.a.load(lanes), self.b.load(lanes));
        let (turn_a, turn_b) = (Rotation::new(a.axis, a.w), Rotation::new(b.axis, b.w));
        // In glam's order: the inverse of A's pose, times B's.
        let (axis, w) = product((a.axis.negated(), a.w), (b.axis, b.w));
        let b_in_a = Rotation::new(axis, w);
        let placed = Placed {
            half_a: a.half_extents,
            half_b: b.half_extents,
            b_in_a,
            a_in_b: b_in_a.inverse(),
            translation: turn_a.inverse().turn(b.position.minus(a.position)),
        };

        points.clear();
        let zero = w.all(0.0);
        let mut axis = Vector::all(zero, [0.0; 3]);
        let mut by_parry = (1 << self.count) - 1;
        if self.boxes != 0 {
            let boxes = lanes::mask(zero, self.boxes);
            let touch = boxes::touch(&placed, boxes, points);
            axis = touch.axis;
            by_parry &= !(self.boxes & !touch.unknown.bits());
        }
        if by_parry != 0 {
            axis = self.ask_parry(by_parry, parry, bodies, axis, points);
        }

        let normal = turn_a.turn(axis).negated();
        let error = (normal.dot(normal).sqrt() - zero.all(1.0)).abs();
        let mut valid = zero.all(NORMAL_TOLERANCE).at_least(error);
        let chosen = reduce(points, axis);
        let nothing = Vector::all(zero, [0.0; 3]);
        let mut contacts = [[Row::default(); 4]; CONTACT_POINTS];
        for (slot, contact) in chosen.iter().zip(&mut contacts) {
            let mut on_b = placed.in_b(slot.on_b);
            if by_parry != 0 {
                on_b = slot.on_b.or(lanes::mask(zero, by_parry), on_b);
            }
            let point = turn_b.turn(on_b).plus(b.position);
            valid = valid.without(slot.taken.without(point.is_finite()));
            let Vector { x, y, z } = point.or(slot.taken, nothing);
            let distance = slot.distance.or(slot.taken, zero);
            *contact = [x.row(), y.row(), z.row(), distance.row()];
        }
        let [first, second, third, fourth] = &chosen;
        let taken =
            [first.taken.bits(), second.taken.bits(), third.taken.bits(), fourth.taken.bits()];
        let normal = normal.rows();
        let valid = valid.bits() & taken[0];
        for (lane, &(body_a, body_b)) in self.pairs.iter().enumerate().take(self.count) {
            if valid >> lane & 1 != 0 {
                let contact = |[x, y, z, distance]: &[Row; 4]| Contact {
                    point: [x.0[lane], y.0[lane], z.0[lane]],
                    distance: distance.0[lane],
                };
                found.push(Collision {
                    body_a,
                    body_b,
                    normal: [normal[0].0[lane], normal[1].0[lane], normal[2].0[lane]],
                    count: taken.iter().map(|taken| taken >> lane & 1).sum(),
                    contacts: contacts.each_ref().map(contact),
                });
            }
        }
    }

    /// Adds parry's points of the pairs in these lanes, on B in its own frame, and sets their axes.
    #[inline(always)]
    fn ask_parry<N: Numbers>(
        &self,
        lanes: u32,
        parry: &mut Parry,
        bodies: &[Body],
        axis: Vector<N>,
        points: &mut Points<N>,
    ) -> Vector<N> {
        let mut rows = axis.rows();
        for (lane, &(a, b)) in self.pairs.iter().enumerate().take(self.count) {
            let Some(geometries) = self.geometries[lane].filter(|_| lanes >> lane & 1 != 0) else {
                continue;
            };
            let pair = [&bodies[a as usize], &bodies[b as usize]];
            let Some((along, places)) = parry.ask(pair, geometries) else { continue };
            for (row, number) in rows.iter_mut().zip(along) {
                row.0[lane] = number;
            }
            let (any, lane) = (axis.x, lanes::mask(axis.x, 1 << lane));
            for place in places {
                let (on_a, on_b) = (Vector::all(any, place.on_a), Vector::all(any, place.on_b));
                points.take(lane, on_a, on_b, any.all(place.distance));
            }
        }
        let [x, y, z] = &rows;
        Vector { x: axis.x.of_row(x), y: axis.x.of_row(y), z: axis.x.of_row(z) }
    }
}

/// The product of two quaternions, as axis and w.
#[inline(always)]
fn product<N: Numbers>(
    (Vector { x: x0, y: y0, z: z0 }, w0): (Vector<N>, N),
    (Vector { x: x1, y: y1, z: z1 }, w1): (Vector<N>, N),
) -> (Vector<N>, N) {
    let axis = Vector {
        x: w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
        y: w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1,
        z: w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1,
    };
    (axis, w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1)
}
