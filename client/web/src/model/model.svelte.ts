// The model of the job that is open, as pictures: asked of the server when a version is new, held by a
// worker.
import { models } from "../api/server";
import { ExportFormat } from "../gen/vantage/v1/model_service_pb";
import type { Scan } from "../gen/vantage/v1/scan_pb";
import type { Job } from "../job/job.svelte";
import type { FloorPlan } from "./floor_plan";
import type { Answer, Ask } from "./model_messages";
import type { Panorama } from "./panorama";
import type { Points } from "./points";
import ModelWorker from "./model.worker?worker";

// Width of a panorama, pixels: a quarter of a degree each, as previews of scans have.
const panoramaWidth = 1440;
// A scan's own samples are fetched up to this size, bytes, for its panorama; of larger ones the model's
// surface has to do. At 28 bytes a sample these are previews, not whole scans of 46 million.
const mostSampleBytes = 40e6;

const keptPanoramas = 4;
// While the first model comes, the plan is drawn anew after each so many bytes.
const peekBytes = 8e6;

export interface StoreyBand {
  // Its place among the storeys, from 0.
  index: number;
  name: string;
  floor: number;
  top: number;
}

export class Model {
  // Version of what is shown; 0: nothing yet.
  version = $state(0n);
  // Changes whenever pictures would be other ones: with the version, and while the first one comes.
  stamp = $state(0);
  // Share of the model that has come, [0, 1]; undefined: nothing is being fetched.
  progress = $state<number | undefined>(undefined);
  failed = $state(false);

  #job: Job;
  #worker: Worker | undefined;
  #asked = 0;
  #open = new Map<number, { resolve: (answer: Answer) => void; reject: (error: Error) => void }>();
  #fetching: AbortController | undefined;
  #wanted = 0n;
  #pictures = 0;
  #panoramas = new Map<string, Panorama>();

  constructor(job: Job) {
    this.#job = job;
  }

  close(): void {
    this.#fetching?.abort();
    this.#worker?.terminate();
    this.#worker = undefined;
    for (const { reject } of this.#open.values()) reject(new Error("closed"));
    this.#open.clear();
  }

  storeys(): StoreyBand[] {
    const known = this.#job.coverage?.storeys ?? [];
    const floors = known.flatMap((storey) =>
      storey.floorZM === undefined ? [] : [{ index: storey.number, name: storey.name, floor: storey.floorZM }],
    );
    if (floors.length === 0) {
      // No level floor is known: what lies below the first station, at a tripod's height.
      const z = this.#job.last?.pose?.translation?.z ?? 0;
      return [{ index: 0, name: "", floor: z - 1.5, top: Infinity }];
    }
    return floors.map((storey, i) => ({ ...storey, top: floors[i + 1]?.floor ?? Infinity }));
  }

  get voxelSize(): number {
    return this.#job.site?.session.modelConfig?.voxelSizeM ?? 0.05;
  }

  get required(): number {
    return this.#job.site?.session.planningConfig?.requiredDensityPerM2 ?? 2500;
  }

  // Fetches the model where it has changed since. What is there stays until the new one is whole.
  async refresh(version: bigint): Promise<void> {
    if (version === 0n || version === this.version || (this.#fetching !== undefined && this.#wanted === version))
      return;
    this.#fetching?.abort();
    const fetching = new AbortController();
    this.#fetching = fetching;
    this.#wanted = version;
    this.progress = 0;
    this.failed = false;
    try {
      await this.#ask({ what: "begin" });
      let came = 0;
      let shown = 0;
      let of = version;
      const stream = models.exportModel(
        { name: this.#job.name, format: ExportFormat.SURFACE_PLY },
        { signal: fetching.signal },
      );
      for await (const piece of stream) {
        if (piece.data.length === 0) continue;
        came += piece.data.length;
        of = piece.modelVersion;
        if (piece.totalSizeBytes > 0n) this.progress = came / Number(piece.totalSizeBytes);
        await this.#ask({ what: "surface", bytes: piece.data });
        // Nothing is shown yet: a plan that grows is better than none.
        if (this.version === 0n && came - shown > peekBytes) {
          shown = came;
          await this.#ask({ what: "peek" });
          this.stamp += 1;
        }
      }
      await this.#ask({ what: "end" });
      this.version = of;
      this.stamp += 1;
    } catch {
      if (fetching.signal.aborted) return;
      this.failed = true;
    } finally {
      if (this.#fetching === fetching) {
        this.#fetching = undefined;
        this.progress = undefined;
      }
    }
  }

  async plan(storey: StoreyBand): Promise<FloorPlan | undefined> {
    const answer = await this.#ask({ what: "plan", ...this.#band(storey) });
    return answer.what === "plan" ? answer.plan : undefined;
  }

  async way(
    storey: StoreyBand,
    from: { x: number; y: number },
    to: { x: number; y: number },
  ): Promise<{ x: number; y: number }[]> {
    const clearance = (this.#job.site?.session.planningConfig?.scannerWidthM ?? 0.6) / 2;
    const place = ({ x, y }: { x: number; y: number }) => ({ x, y });
    const answer = await this.#ask({ what: "way", ...this.#band(storey), from: place(from), to: place(to), clearance });
    return answer.what === "way" ? answer.way : [from, to];
  }

  async points(): Promise<Points | undefined> {
    const answer = await this.#ask({ what: "points", required: this.required });
    return answer.what === "points" ? answer.points : undefined;
  }

  // What is seen from a scan's place, all around: the scan's own samples where they are few enough to fetch,
  // else the model's surface. The last few are kept: a crew goes to and fro between them.
  async panorama(scan: Scan, signal: AbortSignal): Promise<Panorama | undefined> {
    const pose = scan.pose?.translation;
    const key = `${scan.name} ${pose?.x} ${pose?.y} ${scan.replaceTime?.seconds}`;
    const known = this.#panoramas.get(key);
    if (known !== undefined) return known;
    const made = await this.#paintPanorama(scan, signal);
    if (made !== undefined) {
      this.#panoramas.set(key, made);
      const [oldest] = this.#panoramas.keys();
      if (this.#panoramas.size > keptPanoramas && oldest !== undefined) this.#panoramas.delete(oldest);
    }
    return made;
  }

  async #paintPanorama(scan: Scan, signal: AbortSignal): Promise<Panorama | undefined> {
    const eye = scan.pose?.translation;
    if (eye === undefined) return undefined;
    const view = { eye: { x: eye.x, y: eye.y, z: eye.z }, ahead: 0, width: panoramaWidth };
    const bytes = Number(scan.sampleCount) * (28 + (scan.intensity ? 2 : 0) + (scan.colour ? 3 : 0));
    if (bytes > mostSampleBytes) {
      const answer = await this.#ask({ what: "panorama", size: this.voxelSize, ...view });
      return answer.what === "panorama" ? answer.panorama : undefined;
    }
    // What is nearer than this was too near to be measured from there.
    const near = 1.5 * (scan.scannerModel?.minRangeM ?? 0.5);
    const span = scan.scannerModel?.azimuthSpanRad ?? 2 * Math.PI;
    const spacing = span / Math.max(1, scan.columnCount);
    const picture = ++this.#pictures;
    await this.#ask({ what: "beginSamples", picture, spacing, ...view });
    const request = { name: this.#job.name, format: ExportFormat.SCANS_PLY, scans: [scan.name] };
    try {
      for await (const piece of models.exportModel(request, { signal })) {
        if (piece.data.length > 0) await this.#ask({ what: "samples", picture, bytes: piece.data });
      }
    } catch (error) {
      await this.#ask({ what: "endSamples", picture, whole: false, size: this.voxelSize, near: 0 });
      throw error;
    }
    const answer = await this.#ask({ what: "endSamples", picture, whole: true, size: this.voxelSize, near });
    return answer.what === "panorama" ? answer.panorama : undefined;
  }

  #band(storey: StoreyBand) {
    return { floor: storey.floor, top: storey.top, size: this.voxelSize, required: this.required };
  }

  #ask(ask: Ask): Promise<Answer> {
    this.#worker ??= this.#start();
    const id = ++this.#asked;
    const worker = this.#worker;
    return new Promise((resolve, reject) => {
      this.#open.set(id, { resolve, reject });
      worker.postMessage({ id, ask });
    });
  }

  #start(): Worker {
    const worker = new ModelWorker();
    worker.onmessage = (event: MessageEvent<{ id: number; answer?: Answer; error?: string }>) => {
      const { id, answer, error } = event.data;
      const asked = this.#open.get(id);
      this.#open.delete(id);
      if (answer !== undefined) asked?.resolve(answer);
      else asked?.reject(new Error(error));
    };
    return worker;
  }
}
