// Motions as the picture shows them: simulated in the page, or recorded.

/** One instant of a motion. */
export interface Sample {
  /** [s] */
  readonly time: number;
  /** Row of Table 2; 0 with both feet off the ice. */
  readonly contactState: number;
  readonly supportLeg: "right" | "left";
  /** Top of the head [m]. */
  readonly head: ArrayLike<number>;
  /** f_y, N, N at the heel, N at the toe: of the supporting foot, of the free foot [N]. */
  readonly contactForces: ArrayLike<number>;
  /** Both ends (x, y, z) of the 17 links in the world [m]. */
  readonly links: ArrayLike<number>;
  /** Completed gait steps. */
  readonly gaitSteps: number;
  /** Of the centre of mass, forward [m/s]; NaN where it is not known. */
  readonly speed: number;
}

/** Samples at equal intervals; only the last interval may be shorter. */
export interface Motion {
  /** Time between two samples [s]. */
  readonly period: number;
  /** Index of the last sample. */
  readonly last: number;
  /** Is the last sample the end? */
  readonly finished: boolean;
  /** Why the motion ended, or null. */
  readonly termination: string | null;
  /** The sample of an index, or the nearest one. */
  at(index: number): Sample;
}
