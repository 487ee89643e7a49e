import type { BranchInfo } from "./protocol.ts";

/** Samples of a signal that are kept, of a run without an end: of those before, the older half is forgotten. */
export const most_samples = 2 ** 20;

/** Of a signal: the values of its elements at a time. */
export interface Sample { time: number; at(element: number): number }

/** What came of one signal: times in order, and the values of each element at them. */
export class Track {
  times = new Float64Array(1024);
  values: Float64Array[];
  length = 0;
  private readonly extremes: [number, number][]; // least and greatest of all that came

  readonly elements: number;

  constructor(elements: number) {
    this.elements = elements;
    this.values = Array.from({ length: elements }, () => new Float64Array(1024));
    this.extremes = Array.from({ length: elements }, () => [Infinity, -Infinity]);
  }
  least(element: number): number { return this.extremes[element]![0]; }
  greatest(element: number): number { return this.extremes[element]![1]; }

  /** Samples may come in any order of time, and again. */
  add(samples: Sample[]): void {
    samples.sort((a, b) => a.time - b.time);
    const from = this.first_from(samples[0]?.time ?? Infinity), times = this.times.slice(from, this.length);
    const values = this.values.map((data) => data.slice(from, this.length));
    this.length = from; // what comes later is put behind them again
    let next = 0;
    for (const { time, at } of samples) {
      for (; next < times.length && times[next]! <= time; ++next) this.append(times[next]!, (element) => values[element]![next]!);
      this.append(time, at);
    }
    for (; next < times.length; ++next) this.append(times[next]!, (element) => values[element]![next]!);
    ++this.changes;
  }
  private append(time: number, at: (element: number) => number): void {
    if (this.length === most_samples) {
      for (const data of [this.times, ...this.values]) data.copyWithin(0, most_samples / 2, this.length);
      this.length -= most_samples / 2;
    }
    if (this.length === this.times.length) this.reserve(2 * this.length);
    const place = this.length > 0 && this.times[this.length - 1] === time ? this.length - 1 : this.length++;
    this.times[place] = time;
    this.values.forEach((data, element) => {
      const value = (data[place] = at(element)), extremes = this.extremes[element]!;
      if (value < extremes[0]) extremes[0] = value;
      if (value > extremes[1]) extremes[1] = value;
    });
  }
  changes = 0; // that were made to it

  private reserve(size: number): void {
    const grown = (old: Float64Array<ArrayBuffer>) => {
      const data = new Float64Array(size);
      data.set(old.subarray(0, this.length));
      return data;
    };
    this.times = grown(this.times as Float64Array<ArrayBuffer>);
    this.values = this.values.map((data) => grown(data as Float64Array<ArrayBuffer>));
  }

  /** These samples up to a time, and from there on the others. */
  followed_by(other: Track | undefined, from: number): Track {
    const until = this.first_from(from - 1e-9), all = new Track(this.elements), more = other?.length ?? 0;
    all.reserve(Math.max(until + more, 1));
    all.length = until + more;
    all.times.set(this.times.subarray(0, until));
    if (other) all.times.set(other.times.subarray(0, more), until);
    all.values.forEach((data, element) => {
      data.set(this.values[element]!.subarray(0, until));
      if (other) data.set(other.values[element]!.subarray(0, more), until);
      all.extremes[element] = [Math.min(this.least(element), other?.least(element) ?? Infinity), Math.max(this.greatest(element), other?.greatest(element) ?? -Infinity)];
    });
    return all;
  }

  /** The index of the first sample at `time` or later. */
  first_from(time: number): number {
    let low = 0, high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The values that hold at a time; null before the first sample. */
  at(time: number): number[] | null {
    const index = this.first_from(time + 1e-12) - 1;
    return index < 0 ? null : this.values.map((data) => data[index]!);
  }
}

/** All that came in binary frames, by branch and the index of the signal. */
export class Samples {
  private tracks = new Map<number, Map<number, Track>>();
  private branches: BranchInfo[] = [];
  private joined = new Map<string, { track: Track; changes: number }>();

  take(frame: ArrayBuffer): void {
    const view = new DataView(frame), news = new Map<Track, Sample[]>();
    for (let at = 0; at + 20 <= frame.byteLength; ) {
      const index = view.getUint32(at, true), branch = view.getUint32(at + 4, true), n = view.getUint32(at + 8, true);
      const time = view.getFloat64(at + 12, true), first = at + 20;
      if (first + 8 * n > frame.byteLength) break;
      if (index >= 2 ** 31) { // where a world's bodies are
        at = first + 8 * n;
        continue;
      }
      let tracks = this.tracks.get(branch);
      if (!tracks) this.tracks.set(branch, (tracks = new Map()));
      let track = tracks.get(index);
      if (track?.elements !== n) tracks.set(index, (track = new Track(n)));
      const sample: Sample = { time, at: (element) => view.getFloat64(first + 8 * element, true) };
      if (!news.get(track)?.push(sample)) news.set(track, [sample]);
      at = first + 8 * n;
    }
    for (const [track, samples] of news) track.add(samples);
  }

  /** How branches come from each other; what is known of others is forgotten. */
  keep(branches: BranchInfo[]): void {
    this.branches = branches;
    if (branches.length === 0) return; // a run of another program has but one
    for (const branch of this.tracks.keys()) if (!branches.some(({ index }) => index === branch)) this.tracks.delete(branch);
  }

  /** What is known of a signal along a branch: before it begins, of the one that it comes from. */
  along(branch: number, index: number): Track | undefined {
    const own = this.tracks.get(branch)?.get(index), info = this.branches.find((other) => other.index === branch);
    const before = info && info.parent >= 0 ? this.along(info.parent, index) : undefined;
    if (!info || !before || (own && own.elements !== before.elements)) return own;
    const key = `${branch}/${index}`, changes = before.changes + (own?.changes ?? 0), known = this.joined.get(key);
    if (known?.changes === changes) return known.track;
    const track = before.followed_by(own, info.from);
    track.changes = changes;
    this.joined.set(key, { track, changes });
    return track;
  }
}

/** One element of a signal over time: what is known of it `until` then. */
export interface Course { track: Track; element: number; until: number; is_continuous: boolean }

/**
 * What a plot of `columns` pixels shows between two times: two points per column, the least and the greatest value in
 * it, for all elements at the same times. After its last sample a signal keeps its value; between samples, too, but for
 * a continuous one, which runs straight from one to the next.
 */
export function decimated(lines: Course[], from: number, to: number, columns: number): (number | null)[][] {
  const width = (to - from) / columns;
  const times: number[] = [];
  for (let c = 0; c < columns; ++c) times.push(from + c * width, from + (c + 0.5) * width);
  const all: (number | null)[][] = [times];
  for (const { track, element, until, is_continuous } of lines) {
    const data = track.values[element]!, line: (number | null)[] = [];
    let i = track.first_from(from);
    let last = i > 0 ? data[i - 1]! : null;
    const end = Math.max(until, track.length > 0 ? track.times[track.length - 1]! : -Infinity);
    /** Between sample k - 1 and sample k. */
    const between = (k: number, time: number) => {
      const t = track.times[k - 1]!;
      return data[k - 1]! + ((data[k]! - data[k - 1]!) * (time - t)) / (track.times[k]! - t);
    };
    for (let c = 0; c < columns; ++c) {
      let low = Infinity, high = -Infinity, least_at = 0, greatest_at = 0;
      const first = i;
      for (; i < track.length && track.times[i]! < from + (c + 1) * width; ++i) {
        last = data[i]!;
        if (last < low) [low, least_at] = [last, i];
        if (last > high) [high, greatest_at] = [last, i];
      }
      if (is_continuous && first > 0 && first < track.length && i - first < 2) { // too few samples for an extent
        const t = from + c * width, half = t + width / 2;
        line.push(between(first, t), i > first ? data[first]! : between(first, half));
      } else if (low <= high) line.push(...(least_at < greatest_at ? [low, high] : [high, low]));
      else line.push(...(from + c * width <= end ? [last, last] : [null, null]));
    }
    all.push(line);
  }
  return all;
}

/** Two elements at the instants at which the first one was seen, until a time; every so many of them where there are more than `most`. */
export function paired(
  x: { track: Track; element: number }, y: { track: Track; element: number }, until: number, most: number,
): [number[], number[]] {
  const length = x.track.first_from(until + 1e-12), stride = Math.max(1, Math.ceil(length / most));
  const xs: number[] = [], ys: number[] = [];
  let i = -1;
  const take = (k: number) => {
    while (i + 1 < y.track.length && y.track.times[i + 1]! <= x.track.times[k]! + 1e-12) ++i;
    if (i < 0) return;
    xs.push(x.track.values[x.element]![k]!);
    ys.push(y.track.values[y.element]![i]!);
  };
  for (let k = 0; k < length; k += stride) take(k);
  if (length > 0 && (length - 1) % stride !== 0) take(length - 1);
  return [xs, ys];
}
