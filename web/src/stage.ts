// The picture: camera, light, ice, robot, signs.
import { Color, DirectionalLight, Fog, HemisphereLight, PCFShadowMap, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { DARK, HAZE, LIGHT, SUPPORT } from "./colours";
import type { SceneFields } from "./engine";
import { Figure } from "./figure";
import type { CameraName } from "./link";
import type { Sample } from "./motion";
import type { Point, Pose } from "./pose";
import { Rink } from "./rink";
import { Signs } from "./signs";

/** Azimuth from the robot's right side towards its front, elevation [rad]. */
const VIEWS: Record<CameraName, [azimuth: number, elevation: number]> = {
  angle: [0.55, 0.22],
  side: [0, 0.06],
  front: [1.45, 0.12],
  above: [0.2, 1.2],
};
const DISTANCE = 5;
/** Height of a note, width of a digit, and of what is beside the text [px]. */
const NOTE_HEIGHT = 17;
const NOTE_DIGIT = 8;
const NOTE_MARGIN = 14;
/** Height at the middle of the picture [m]. */
const MIDDLE = 1.05;
/** The baseline skates so far to the left of the policy [m]. */
const LANE = -1.3;

export class Stage {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(32, 1, 0.1, 120);
  private readonly sun = new DirectionalLight("#FFFFFF", 2.2);
  private readonly figure = new Figure();
  private readonly baseline = new Figure(true);
  private readonly rink = new Rink();
  private readonly signs = new Signs();
  private readonly notes: HTMLElement[] = [];
  private readonly focus = new Vector3(0, 0, MIDDLE);
  private azimuth = 0;
  private elevation = 0;
  private distance = DISTANCE;
  /** Number of changes of the view. */
  version = 0;
  showForces = true;
  private aimedSpeed = 0;

  /** Throws an Error where WebGL is missing. */
  constructor(private readonly canvas: HTMLCanvasElement, private readonly notesIn: HTMLElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.camera.up.set(0, 0, 1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow.camera, { left: -2, right: 2, top: 2.5, bottom: -2.5, near: 0.5, far: 14 });
    this.baseline.group.position.x = LANE;
    this.scene.add(this.figure.group, this.baseline.group, this.rink.group, this.signs.group, this.sun, this.sun.target);
    this.scene.add(new HemisphereLight("#FFFFFF", "#8899AA", 1.6));
    this.look("angle");
  }

  /** Speed of the kick that is being aimed [m/s]; 0 for none. */
  get aimed(): number {
    return this.aimedSpeed;
  }
  set aimed(speed: number) {
    this.aimedSpeed = speed;
    this.version += 1;
  }

  look(camera: CameraName): void {
    this.version += 1;
    [this.azimuth, this.elevation] = VIEWS[camera];
    this.distance = DISTANCE;
  }

  /** Turn the camera by angles [rad]. */
  turn(azimuth: number, elevation: number): void {
    this.version += 1;
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.max(this.elevation + elevation, 0.01), 1.5);
  }

  zoom(factor: number): void {
    this.version += 1;
    this.distance = Math.min(Math.max(this.distance * factor, 1.5), 20);
  }

  recolour(dark: boolean): void {
    this.version += 1;
    const palette = dark ? DARK : LIGHT;
    this.scene.background = new Color(palette.sky);
    this.scene.fog = new Fog(palette.sky, 9, 30);
    this.rink.recolour(palette);
    this.signs.recolour(palette.text);
  }

  /** Direction of the forward axis in the picture [px per m], for aiming kicks. */
  forwardOnScreen(): { x: number; y: number } {
    const { width, height } = this.canvas.getBoundingClientRect();
    const [a, b] = [this.focus.clone(), this.focus.clone().add(new Vector3(0, 0.5, 0))].map((p) => p.project(this.camera));
    if (a === undefined || b === undefined) return { x: 0, y: 0 };
    return { x: (b.x - a.x) * width, y: -(b.y - a.y) * height };
  }

  /** Is a point of the page on the robot's body? */
  hits(x: number, y: number): boolean {
    const box = this.canvas.getBoundingClientRect();
    const place = this.focus.clone().project(this.camera);
    const centre = { x: box.left + ((place.x + 1) / 2) * box.width, y: box.top + ((1 - place.y) / 2) * box.height };
    // Height of 1.7 m in the picture.
    const size = (1.7 / (2 * this.distance * Math.tan((Math.PI * this.camera.fov) / 360))) * box.height;
    return Math.abs(x - centre.x) < 0.35 * size && Math.abs(y - centre.y) < 0.6 * size;
  }

  /** Draw a sample; the head's target, if the scene has one; the pose of the baseline, if there is one. */
  draw(pose: Pose, sample: Sample, lifting: SceneFields["control"]["lifting"], baseline: Pose | null): void {
    const hips = middle(pose.legs[0].hip, pose.legs[1].hip);
    this.focus.set(0, hips[1], MIDDLE);
    this.figure.put(pose);
    this.rink.follow(hips[1]);
    this.signs.headTarget(pose, lifting);
    this.signs.kick(pose.chest, this.aimedSpeed);
    const notes = this.signs.forces(sample, pose, this.showForces);
    this.baseline.group.visible = baseline !== null;
    if (baseline !== null) {
      this.baseline.put(baseline);
      const place = new Vector3(...baseline.top);
      place.x += LANE;
      notes.push({ at: place, text: "baseline", colour: HAZE }, { at: new Vector3(...pose.top), text: "policy", colour: SUPPORT });
    }
    this.sun.position.set(2.5, hips[1] - 1.5, 6);
    this.sun.target.position.set(0, hips[1], 0);
    this.resize();
    const flat = this.distance * Math.cos(this.elevation);
    this.camera.position.copy(this.focus);
    this.camera.position.x += flat * Math.cos(this.azimuth);
    this.camera.position.y += flat * Math.sin(this.azimuth);
    this.camera.position.z += this.distance * Math.sin(this.elevation);
    this.camera.lookAt(this.focus);
    this.renderer.render(this.scene, this.camera);
    this.write(notes);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(window.devicePixelRatio, 2);
    if (this.canvas.width === Math.floor(width * ratio) && this.canvas.height === Math.floor(height * ratio)) return;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    // Narrow pictures keep the robot's width in view.
    this.camera.fov = this.camera.aspect < 1 ? 40 : 32;
    this.camera.updateProjectionMatrix();
  }

  /** Write numbers beside their arrows. */
  private write(notes: { at: Vector3; text: string; colour: string }[]): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    while (this.notes.length < notes.length) {
      const note = document.createElement("span");
      note.className = "note";
      this.notesIn.append(note);
      this.notes.push(note);
    }
    const taken: { x: number; y: number; width: number }[] = [];
    this.notes.forEach((element, i) => {
      const note = notes[i];
      const place = note?.at.clone().project(this.camera);
      // What is behind the camera has a depth above 1.
      element.hidden = note === undefined || place === undefined || place.z > 1;
      if (note === undefined || place === undefined || element.hidden) return;
      const x = ((place.x + 1) / 2) * width;
      let y = ((1 - place.y) / 2) * height;
      const size = NOTE_MARGIN + NOTE_DIGIT * note.text.length;
      // A note that would cover an earlier one stands above it.
      const covers = (other: (typeof taken)[number]) =>
        Math.abs(y - other.y) < NOTE_HEIGHT && x < other.x + other.width && other.x < x + size;
      for (let other = taken.find(covers); other !== undefined; other = taken.find(covers)) y = other.y - NOTE_HEIGHT;
      taken.push({ x, y, width: size });
      element.style.transform = `translate(${x.toFixed(0)}px, ${y.toFixed(0)}px) translate(6px, -100%)`;
      element.style.setProperty("--mark", note.colour);
      element.textContent = note.text;
    });
  }
}

function middle(a: Point, b: Point): Point {
  return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2];
}
