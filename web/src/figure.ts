// The robot as a person: round limbs, a head that looks ahead, skates. As skate_env/render/figure.py.
import { Color, CylinderGeometry, Group, Mesh, MeshStandardMaterial, SphereGeometry, Vector3 } from "three";
import { FREE, HAZE, SUPPORT } from "./colours";
import type { Leg, Pose } from "./pose";

const UP = new Vector3(0, 1, 0);
const BALL = new SphereGeometry(1, 24, 16);

/** How far a faded robot pales. */
const HAZE_SHARE = 0.65;

function paint(material: MeshStandardMaterial, colour: string, faded: boolean): void {
  material.color.set(colour);
  if (faded) material.color.lerp(new Color(HAZE), HAZE_SHARE);
}

function material(colour: string, metalness = 0): MeshStandardMaterial {
  return new MeshStandardMaterial({ color: colour, roughness: metalness > 0 ? 0.35 : 0.75, metalness });
}

/** A round limb between two points, with a radius at each end [m]. */
class Limb {
  readonly group = new Group();
  private readonly shaft: Mesh;
  private readonly balls: [Mesh, Mesh];

  constructor(radii: [number, number], readonly material: MeshStandardMaterial) {
    const [a, b] = radii;
    this.shaft = new Mesh(new CylinderGeometry(b, a, 1, 24, 1, true), material);
    this.balls = [new Mesh(BALL, material), new Mesh(BALL, material)];
    this.balls[0].scale.setScalar(a);
    this.balls[1].scale.setScalar(b);
    this.group.add(this.shaft, ...this.balls);
    for (const mesh of [this.shaft, ...this.balls]) mesh.castShadow = true;
  }

  put(from: Vector3, to: Vector3): void {
    const along = to.clone().sub(from);
    const length = along.length();
    this.shaft.scale.y = Math.max(length, 1e-6);
    if (length > 0) this.shaft.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
    this.shaft.position.copy(from).add(to).multiplyScalar(0.5);
    this.balls[0].position.copy(from);
    this.balls[1].position.copy(to);
  }
}

const vector = (p: readonly [number, number, number]) => new Vector3(...p);
const between = (a: Vector3, b: Vector3, share: number) => a.clone().lerp(b, share);
const unit = (from: Vector3, to: Vector3) => to.clone().sub(from).normalize();
const moved = (p: Vector3, along: Vector3, length: number) => p.clone().addScaledVector(along, length);

/** Thigh, shank, ankle, boot, blade, heel post, toe post. */
class LegFigure {
  private readonly cloth = material(SUPPORT);
  private readonly limbs: Limb[];

  constructor(group: Group, private readonly faded: boolean) {
    const boot = material("#262C36");
    const steel = material("#9AA7B4", 0.8);
    this.limbs = [
      new Limb([0.088, 0.06], this.cloth),
      new Limb([0.06, 0.042], this.cloth),
      new Limb([0.05, 0.05], boot),
      new Limb([0.038, 0.028], boot),
      new Limb([0.01, 0.01], steel),
      new Limb([0.012, 0.012], steel),
      new Limb([0.012, 0.012], steel),
    ];
    for (const limb of this.limbs) group.add(limb.group);
  }

  put(leg: Leg, supports: boolean): void {
    paint(this.cloth, supports ? SUPPORT : FREE, this.faded);
    const [heel, toe, ankle, knee, hip] = [leg.heel, leg.toe, leg.ankle, leg.knee, leg.hip].map(vector) as
      [Vector3, Vector3, Vector3, Vector3, Vector3];
    const along = unit(heel, toe);
    const foot = moved(heel, along, ankle.clone().sub(heel).dot(along));
    const up = unit(foot, ankle);
    const behind = foot.distanceTo(heel);
    const before = toe.distanceTo(foot);
    const back = moved(moved(foot, along, -Math.min(0.6 * behind, 0.07)), up, 0.058);
    const front = moved(moved(foot, along, Math.min(0.75 * before, 0.17)), up, 0.046);
    const places: [Vector3, Vector3][] = [
      [hip, knee],
      [knee, ankle],
      [moved(ankle, up, 0.02), moved(ankle, up, 0.055)],
      [back, front],
      [moved(heel, up, 0.01), moved(toe, up, 0.01)],
      [back, moved(back, up, -0.05)],
      [front, moved(front, up, -0.038)],
    ];
    places.forEach(([from, to], i) => this.limbs[i]?.put(from, to));
  }
}

export class Figure {
  readonly group = new Group();
  private readonly legs: readonly [LegFigure, LegFigure];
  private readonly rest: Limb[];

  /** A faded robot is the one that another is compared with. */
  constructor(faded = false) {
    this.legs = [new LegFigure(this.group, faded), new LegFigure(this.group, faded)];
    const jacket = material("#4A5A70");
    const sleeve = material("#6B7A90");
    const skin = material("#F1D9C0");
    const helmet = material("#F4F6F8");
    const visor = material("#1E2530", 0.5);
    const arm = () => [
      new Limb([0.06, 0.045], sleeve),
      new Limb([0.045, 0.035], sleeve),
      new Limb([0.036, 0.034], skin),
    ];
    this.rest = [
      new Limb([0.1, 0.1], jacket),
      new Limb([0.105, 0.098], jacket),
      new Limb([0.098, 0.132], jacket),
      new Limb([0.072, 0.072], jacket),
      new Limb([0.052, 0.046], skin),
      new Limb([0.06, 0.09], skin),
      new Limb([0.098, 0.098], helmet),
      new Limb([0.052, 0.052], visor),
      ...arm(),
      ...arm(),
    ];
    for (const limb of this.rest) {
      this.group.add(limb.group);
      if (faded) limb.material.color.set(HAZE);
    }
  }

  put(pose: Pose): void {
    this.legs.forEach((leg, i) => leg.put(pose.legs[i as 0 | 1], pose.support === i));
    const places = [...trunk(pose), ...head(pose), ...pose.arms.flatMap(armPlaces)];
    places.forEach(([from, to], i) => this.rest[i]?.put(from, to));
  }
}

type Place = [Vector3, Vector3];

function trunk(pose: Pose): Place[] {
  const [right, left] = pose.legs.map((leg) => vector(leg.hip)) as Place;
  const [loin, chest, neck] = [vector(pose.loin), vector(pose.chest), vector(pose.neck)];
  const shoulders = pose.arms.map((arm) => vector(arm[0] ?? pose.neck)) as Place;
  const middle = between(...shoulders, 0.5);
  const lowered = (p: Vector3) => moved(between(p, middle, 0.35), unit(chest, neck), -0.035);
  return [
    [between(right, left, 0.2), between(left, right, 0.2)],
    [loin, chest],
    [chest, between(chest, neck, 0.72)],
    [lowered(shoulders[0]), lowered(shoulders[1])],
  ];
}

function head(pose: Pose): Place[] {
  const [neck, top] = [vector(pose.neck), vector(pose.top)];
  const up = unit(neck, top);
  const [right, left] = pose.arms.map((arm) => vector(arm[0] ?? pose.neck)) as Place;
  const side = unit(left, right);
  const ahead = up.clone().cross(side);
  const skull = moved(top, up, -0.098);
  const goggles = moved(moved(skull, ahead, 0.05), up, -0.022);
  return [
    [moved(neck, up, -0.02), moved(neck, up, 0.08)],
    [moved(moved(neck, up, 0.085), ahead, 0.03), skull],
    [moved(skull, ahead, -0.012), skull],
    [moved(goggles, side, -0.055), moved(goggles, side, 0.055)],
  ];
}

function armPlaces(arm: readonly (readonly [number, number, number])[]): Place[] {
  const [shoulder, elbow, wrist, tips] = arm.map(vector) as [Vector3, Vector3, Vector3, Vector3];
  return [[shoulder, elbow], [elbow, wrist], [wrist, between(wrist, tips, 0.62)]];
}
