// The ice with a line at every metre. It moves along with the robot, so that it has no end.
import { BoxGeometry, CanvasTexture, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, PlaneGeometry, Sprite, SpriteMaterial } from "three";
import type { Palette } from "./colours";

/** Lines ahead of and behind the robot [m]. */
const REACH = 14;
const LABEL_INTERVAL = 2;
/** Half width of the lines [m]. */
const HALF_WIDTH = 1.2;

export class Rink {
  readonly group = new Group();
  private readonly ice = new MeshStandardMaterial({ roughness: 0.35 });
  private readonly line = new MeshBasicMaterial();
  private readonly lines = new Group();
  private readonly labels: Label[] = [];
  private palette: Palette | null = null;

  constructor() {
    const ice = new Mesh(new PlaneGeometry(80, 80), this.ice);
    ice.receiveShadow = true;
    this.group.add(ice, this.lines);
    for (let i = -REACH; i <= REACH; i++) {
      const strong = i % LABEL_INTERVAL === 0;
      const box = new BoxGeometry(2 * HALF_WIDTH, strong ? 0.02 : 0.01, 0.001);
      const line = new Mesh(box, this.line);
      line.position.y = i;
      this.lines.add(line);
      if (strong) {
        const label = new Label();
        label.sprite.position.set(-HALF_WIDTH - 0.3, i, 0.08);
        this.labels.push(label);
        this.lines.add(label.sprite);
      }
    }
  }

  /** Centre the lines near a place along the track [m]. */
  follow(y: number): void {
    const centre = LABEL_INTERVAL * Math.round(y / LABEL_INTERVAL);
    this.group.position.y = centre;
    this.labels.forEach((label, i) => {
      label.write(`${centre + LABEL_INTERVAL * i - REACH} m`, this.palette?.text ?? "#000");
    });
  }

  recolour(palette: Palette): void {
    this.palette = palette;
    this.ice.color.set(palette.ice);
    this.line.color.set(palette.line);
    for (const label of this.labels) label.forget();
  }
}

class Label {
  private readonly canvas = document.createElement("canvas");
  private readonly texture = new CanvasTexture(this.canvas);
  readonly sprite = new Sprite(new SpriteMaterial({ map: this.texture, depthWrite: false }));
  private written = "";

  constructor() {
    [this.canvas.width, this.canvas.height] = [128, 48];
    this.sprite.scale.set(0.4, 0.15, 1);
  }

  write(text: string, colour: string): void {
    if (text === this.written) return;
    this.written = text;
    const pen = this.canvas.getContext("2d");
    if (pen === null) return;
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.font = "32px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = colour;
    pen.fillText(text, this.canvas.width / 2, this.canvas.height / 2);
    this.texture.needsUpdate = true;
  }

  forget(): void {
    this.written = "";
  }
}
