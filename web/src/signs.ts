// What is drawn in the world beside the robot: forces of the ice, head target, the arrow of a kick.
import { BufferGeometry, ConeGeometry, CylinderGeometry, Group, Line, LineDashedMaterial, Mesh, MeshBasicMaterial, SphereGeometry, TorusGeometry, Vector3 } from "three";
import { PULL, PUSH, SUPPORT, TARGET } from "./colours";
import type { Sample } from "./motion";
import type { Point, Pose } from "./pose";

/** Length of an arrow [m/N]; its limit [m]; forces below this are not drawn [N]. */
const PER_NEWTON = 0.4e-3;
const LONGEST = 1.1;
const LEAST = 5;
const UP = new Vector3(0, 1, 0);

/** A number beside an arrow: where it stands, and what it says. */
export interface Note {
  at: Vector3;
  text: string;
  colour: string;
}

class Arrow {
  readonly group = new Group();
  private readonly material = new MeshBasicMaterial({ depthTest: false, transparent: true });
  private readonly shaft = new Mesh(new CylinderGeometry(0.012, 0.012, 1, 12), this.material);
  private readonly head = new Mesh(new ConeGeometry(0.037, 0.075, 16), this.material);

  constructor() {
    this.group.add(this.shaft, this.head);
    this.group.renderOrder = this.shaft.renderOrder = this.head.renderOrder = 2;
    this.group.visible = false;
  }

  put(tail: Vector3, tip: Vector3, colour: string): void {
    const along = tip.clone().sub(tail);
    const length = along.length();
    this.group.visible = length > 1e-3;
    if (!this.group.visible) return;
    this.material.color.set(colour);
    const size = Math.min(1, length / 0.075);
    this.group.position.copy(tail);
    this.group.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
    this.head.scale.setScalar(size);
    this.head.position.y = length - 0.0375 * size;
    this.shaft.scale.y = Math.max(length - 0.075 * size, 1e-4);
    this.shaft.position.y = this.shaft.scale.y / 2;
  }

  hide(): void {
    this.group.visible = false;
  }
}

export class Signs {
  readonly group = new Group();
  private readonly arrows = [new Arrow(), new Arrow(), new Arrow(), new Arrow()];
  private readonly kickArrow = new Arrow();
  private readonly target = new Group();
  private readonly thread = new Line(new BufferGeometry(), new LineDashedMaterial({ dashSize: 0.03, gapSize: 0.02 }));

  constructor() {
    const yellow = new MeshBasicMaterial({ color: TARGET });
    const ink = new MeshBasicMaterial({ color: "#1E2A38" });
    // Its ends move, and three.js would cull it by its first place.
    this.thread.frustumCulled = false;
    const ring = new Mesh(new TorusGeometry(0.055, 0.01, 8, 32), ink);
    ring.rotation.y = Math.PI / 2;
    this.target.add(new Mesh(new SphereGeometry(0.045, 24, 16), yellow), ring);
    this.group.add(...this.arrows.map((arrow) => arrow.group), this.kickArrow.group, this.target, this.thread);
  }

  recolour(text: string): void {
    this.thread.material.color.set(text);
  }

  /** Draw the forces of the ice; returns their numbers. */
  forces(sample: Sample, pose: Pose, shown: boolean): Note[] {
    const notes: Note[] = [];
    const forces = Array.from(sample.contactForces);
    for (const foot of [0, 1] as const) {
      const leg = pose.legs[(pose.support ^ foot) as 0 | 1];
      const [along = 0, , ...normals] = forces.slice(4 * foot, 4 * foot + 4);
      const load = Math.abs(normals[0] ?? 0) + Math.abs(normals[1] ?? 0);
      normals.forEach((normal, end) => {
        const arrow = this.arrows[2 * foot + end] as Arrow;
        if (!shown || Math.abs(normal) < LEAST) return arrow.hide();
        const place = new Vector3(...(end === 0 ? leg.heel : leg.toe));
        // Both ends share the friction as they share the load.
        const force = new Vector3(0, (along * Math.abs(normal)) / load, normal);
        const size = force.length();
        const reach = force.multiplyScalar(Math.min(size * PER_NEWTON, LONGEST) / size);
        // What pushes begins at the sole; what pulls ends there.
        const [tail, tip] = normal > 0 ? [place, place.clone().add(reach)] : [place.clone().sub(reach), place];
        const colour = normal > 0 ? PUSH : PULL;
        arrow.put(tail, tip, colour);
        const highest = tail.z > tip.z ? tail : tip;
        notes.push({ at: highest, text: `${normal < 0 ? "−" : ""}${size.toFixed(0)} N`, colour });
      });
    }
    return notes;
  }

  /** Draw the head's target, if the scene has one. */
  headTarget(pose: Pose, law: { ahead: number; height: number } | null | undefined): void {
    this.target.visible = this.thread.visible = law != null;
    if (law == null) return;
    const { ankle } = pose.legs[pose.support];
    const place = new Vector3(0, ankle[1] + law.ahead, law.height);
    this.target.position.copy(place);
    this.thread.geometry.setFromPoints([new Vector3(...pose.top), place]);
    this.thread.computeLineDistances();
  }

  /** Draw a kick of a speed [m/s] at a place; 0 for none. */
  kick(at: Point, speed: number): void {
    if (speed === 0) return this.kickArrow.hide();
    const tip = new Vector3(...at);
    const tail = tip.clone();
    tip.y += Math.sign(speed) * (0.15 + 0.35 * Math.abs(speed));
    this.kickArrow.put(tail, tip, SUPPORT);
  }
}
