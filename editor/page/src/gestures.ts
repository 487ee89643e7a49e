import { hit, key_of, panned, rectangle, to_drawing, within, zoomed, type Hit } from "./geometry.ts";
import { fits, joined, last_of } from "./operations.ts";
import type { Element, Point, Port, Rectangle } from "./protocol.ts";
import { grid, type End, type Session } from "./session.svelte.ts";

export interface Press { x: number; y: number; button: number; shift: boolean; is_panning: boolean; is_touch: boolean }

type Gesture =
  | { kind: "pan"; last: Point }
  | { kind: "band"; from: Point; before: ReadonlySet<string> }
  | { kind: "move"; from: Point; delta: Point; is_moving: boolean; pressed: Element; shift: boolean }
  | { kind: "pull"; end: End; loose: Element | null; from: Point };

const reach = 6; // pixels around the pointer

/** What pointers mean on the drawing. Points are on the screen, from the canvas's upper left corner. */
export class Gestures {
  band: Rectangle | null = null;
  pulled: { from: Point; to: Point; fits: Port[] } | null = null;
  private gesture: Gesture | null = null;

  private readonly session: Session;
  private readonly repaint: () => void;

  constructor(session: Session, repaint: () => void) {
    this.session = session;
    this.repaint = repaint;
  }

  private point(at: Point): Point { return to_drawing(this.session.view, at); }
  at(p: Point): Hit | null {
    const { drawing, view } = this.session;
    return drawing ? hit(drawing, this.point(p), reach / view.scale) : null;
  }

  down(press: Press): void {
    const s = this.session, found = this.at(press), point = this.point(press);
    s.renamed = null;
    if (press.button === 1 || press.is_panning || (press.is_touch && !found)) this.gesture = { kind: "pan", last: press };
    else if (press.button !== 0) return;
    else if (found?.port) this.pull(found.element, found.port);
    else if (found) {
      const key = key_of(found.element);
      if (press.shift) s.toggle(key);
      else if (!s.selection.has(key)) s.select([key]);
      s.begin_drag();
      this.gesture = { kind: "move", from: point, delta: { x: 0, y: 0 }, is_moving: false, pressed: found.element, shift: press.shift };
    } else {
      if (!press.shift) s.select([]);
      this.gesture = { kind: "band", from: point, before: s.selection };
    }
  }

  /** A wire grows from a port; from an input that has one, its end comes loose. */
  private pull(element: Element, port: Port): void {
    const elements = this.session.drawing!.elements;
    const ends = [`${element.path}.${port.name}`, element.path];
    const loose = port.is_output || !port.is_wired ? undefined
      : elements.find((e) => e.kind === "wire" && ends.includes(e.path));
    const source = loose && this.source_of(loose);
    const end = source ?? { element, port };
    this.gesture = { kind: "pull", end, loose: source ? loose! : null, from: end.port.at };
  }
  private source_of(wire: Element): End | null {
    const [name, port] = wire.from.split(".");
    const element = this.session.drawing!.elements.find((e) => e.kind !== "wire" && e.path === joined(this.session.system, name!));
    const outputs = element?.ports.filter((p) => p.is_output) ?? [];
    const found = outputs.find((p) => p.name === port) ?? (outputs.length === 1 ? outputs[0] : undefined);
    return element && found ? { element, port: found } : null;
  }

  move(at: Point, is_free: boolean): void {
    const s = this.session, point = this.point(at), g = this.gesture;
    s.cursor = point;
    if (!g) {
      const found = this.at(at);
      s.hovered = found ? key_of(found.element) : null;
      return;
    }
    if (g.kind === "pan") {
      s.view = panned(s.view, at.x - g.last.x, at.y - g.last.y);
      g.last = at;
    } else if (g.kind === "band") {
      this.band = rectangle(g.from, point);
      s.select([...g.before, ...within(s.drawing!, this.band).map(key_of)]);
    } else if (g.kind === "pull") {
      const targets = s.drawing!.elements.flatMap((e) => e.ports.filter((p) => this.may_join(g, { element: e, port: p })));
      this.pulled = { from: g.from, to: point, fits: targets };
      const over = this.at(at);
      s.hovered = over ? key_of(over.element) : null;
    } else {
      this.drag(g, point, is_free);
    }
    this.repaint();
  }
  private may_join(g: { end: End; loose: Element | null }, other: End): boolean {
    const is_own = g.loose && [`${other.element.path}.${other.port.name}`, other.element.path].includes(g.loose.path);
    return other.element !== g.end.element && (fits(g.end.port, other.port) || (is_own === true && !other.port.is_output));
  }
  private drag(g: Extract<Gesture, { kind: "move" }>, point: Point, is_free: boolean): void {
    const s = this.session, first = s.drag_start[0];
    if (!g.is_moving && Math.hypot(point.x - g.from.x, point.y - g.from.y) * s.view.scale < 4) return;
    g.is_moving = true;
    if (!first) return;
    const step = is_free ? 1 : grid, on = (start: number, by: number) => Math.round((start + by) / step) * step - start;
    g.delta = { x: on(first.at.x, point.x - g.from.x), y: on(first.at.y, point.y - g.from.y) };
    void s.redraw(s.moves(g.delta));
  }

  async up(at: Point): Promise<void> {
    const s = this.session, g = this.gesture, found = this.at(at), point = this.point(at);
    this.gesture = this.band = this.pulled = null;
    this.repaint();
    if (g?.kind === "move") {
      if (g.is_moving) await s.drop(g.delta);
      else this.click(g);
    } else if (g?.kind === "pull") {
      await this.end_pull(g, found, point);
    }
  }
  private click(g: Extract<Gesture, { kind: "move" }>): void {
    const s = this.session;
    if (g.shift) return;
    s.select([key_of(g.pressed)]);
    if (g.pressed.kind === "wire" && s.run.state !== "none") s.watch(s.source_of(g.pressed));
  }
  private async end_pull(g: Extract<Gesture, { kind: "pull" }>, found: Hit | null, point: Point): Promise<void> {
    const s = this.session;
    const candidates = (found?.port ? [found.port] : found?.element.ports ?? [])
      .filter((port) => this.may_join(g, { element: found!.element, port }));
    const port = candidates[0];
    const off = g.loose && ({ do: "disconnect", system: s.system, from: g.loose.from, to: g.loose.to } as const);
    if (port && g.loose && [`${found!.element.path}.${port.name}`, found!.element.path].includes(g.loose.path)) return;
    if (port) {
      const end = { element: found!.element, port };
      if (!off) await s.connect(g.end, end);
      else await s.reconnect(off, g.end, end);
    } else if (off && !found) await s.edit(off);
    else if (!found && Math.hypot(point.x - g.from.x, point.y - g.from.y) > 15) s.dialog = { kind: "insert", at: point, from: g.end };
  }
  cancel(): boolean {
    const was = this.gesture !== null;
    if (this.gesture?.kind === "move") void this.session.redraw([]);
    this.gesture = this.band = this.pulled = null;
    this.repaint();
    return was;
  }

  twice(at: Point): void {
    const s = this.session, found = this.at(at);
    if (!found) s.dialog = { kind: "search", at: this.point(at) };
    else if (found.element.kind === "wire" || found.element.kind === "note" || found.port) return;
    else if (found.is_name || found.element.kind !== "subsystem") s.renamed = found.is_name ? key_of(found.element) : null;
    else void s.enter(found.element.path);
  }

  /** A wheel that turns by notches zooms; two fingers pan, and zoom where the browser says so by Ctrl. */
  wheel(at: Point, dx: number, dy: number, is_zoom: boolean): void {
    const s = this.session, is_notch = dx === 0 && Math.abs(dy) >= 100;
    s.view = is_zoom || is_notch ? zoomed(s.view, at, Math.exp(-dy * (is_notch ? 0.0015 : 0.01))) : panned(s.view, -dx, -dy);
  }
  pinch(at: Point, factor: number, dx: number, dy: number): void {
    this.gesture = null;
    this.session.view = panned(zoomed(this.session.view, at, factor), dx, dy);
  }
}

/** What a tool tip says: of a port, else of its element. */
export function tip_of(found: Hit): string[] {
  const { element, port } = found;
  if (port) return [`${last_of(element.path)}.${port.name}`, port.about].filter(Boolean);
  return [element.title, element.description, ...element.marks.flatMap((m) => [`⚠ ${m.message}`, m.remedy])].filter(Boolean);
}

