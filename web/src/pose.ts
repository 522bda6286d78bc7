// Places of the robot's joints, named by right and left, so that poses of two instants can be mixed.
import type { Sample } from "./motion";

export type Point = [x: number, y: number, z: number];

export interface Leg {
  heel: Point;
  toe: Point;
  ankle: Point;
  knee: Point;
  hip: Point;
}

export interface Pose {
  legs: [right: Leg, left: Leg];
  /** Index of the supporting leg. */
  support: 0 | 1;
  loin: Point;
  chest: Point;
  neck: Point;
  /** Top of the head. */
  top: Point;
  /** Shoulder, elbow, wrist, finger tips: right, left. */
  arms: [Point[], Point[]];
}

/** The pose of a sample, from the ends of the 17 links. */
export function poseOf(sample: Sample): Pose {
  const { links } = sample;
  const end = (link: number, side: 0 | 1): Point => {
    const at = 6 * link + 3 * side;
    return [links[at] ?? 0, links[at + 1] ?? 0, links[at + 2] ?? 0];
  };
  // Links of the supporting leg run upwards, those of the free leg downwards.
  const leg = (foot: number, shank: number, thigh: number, lower: 0 | 1): Leg => ({
    heel: end(foot, 0),
    toe: end(foot, 1),
    ankle: end(shank, lower),
    knee: end(thigh, lower),
    hip: end(thigh, lower === 0 ? 1 : 0),
  });
  const supporting = leg(0, 1, 2, 0);
  const free = leg(6, 5, 4, 1);
  const arm = (upper: number): Point[] => [end(upper, 0), end(upper + 1, 0), end(upper + 2, 0), end(upper + 2, 1)];
  const right = sample.supportLeg === "right";
  return {
    legs: right ? [supporting, free] : [free, supporting],
    support: right ? 0 : 1,
    loin: end(7, 0),
    chest: end(9, 0),
    neck: end(9, 1),
    top: end(16, 1),
    arms: [arm(10), arm(13)],
  };
}

function mixPoint(a: Point, b: Point, share: number): Point {
  return [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])];
}

function mixLeg(a: Leg, b: Leg, share: number): Leg {
  return {
    heel: mixPoint(a.heel, b.heel, share),
    toe: mixPoint(a.toe, b.toe, share),
    ankle: mixPoint(a.ankle, b.ankle, share),
    knee: mixPoint(a.knee, b.knee, share),
    hip: mixPoint(a.hip, b.hip, share),
  };
}

/** The pose between two instants, for slow motion; `share` is 0 at the first, 1 at the second. */
export function mix(a: Pose, b: Pose, share: number): Pose {
  const arm = (side: 0 | 1) => a.arms[side].map((p, i) => mixPoint(p, b.arms[side][i] ?? p, share));
  return {
    legs: [mixLeg(a.legs[0], b.legs[0], share), mixLeg(a.legs[1], b.legs[1], share)],
    support: share < 1 ? a.support : b.support,
    loin: mixPoint(a.loin, b.loin, share),
    chest: mixPoint(a.chest, b.chest, share),
    neck: mixPoint(a.neck, b.neck, share),
    top: mixPoint(a.top, b.top, share),
    arms: [arm(0), arm(1)],
  };
}
