import { badge_of, centre, hit, key_of, nearest_piece, panned, rectangle, to_drawing, wire_at, within, zoomed, type Hit } from "./geometry.ts";
import { axis_of, grid, grips, handle_at, type Handle } from "./layout.ts";
import { fits, joined, last_of, may_enter, through } from "./operations.ts";
import type { Drawing, Element, Point, Port, Rectangle } from "./protocol.ts";
import type { End } from "./dialog.ts";
import type { Session } from "./session.svelte.ts";

export interface Press { x: number; y: number; button: number; shift: boolean; is_panning: boolean; is_touch: boolean }

type Gesture =
  | { kind: "pan"; last: Point }
  | { kind: "band"; from: Point; before: ReadonlySet<string> }
  | { kind: "move"; from: Point; delta: Point; is_moving: boolean; pressed: Element; shift: boolean; before: Drawing; into: Element | null }
  | { kind: "bend"; from: Point; before: Drawing; wire: Element; piece: number; tried: ReturnType<Session["try_bend"]> }
  | { kind: "resize"; from: Point; block: Element; handle: Handle; tried: ReturnType<Session["try_size"]> | null }
  | { kind: "pull"; end: End; loose: Element | null; from: Point; has_left: boolean }; // the element where it began

const reach = 6; // pixels around the pointer
/** How far something goes that starts at `start` and is dragged by `by`. */
const on = (start: number, by: number, is_free: boolean): number => {
  const step = is_free ? 1 : grid;
  return Math.round((start + by) / step) * step - start;
};

/** What pointers mean on the drawing. Points are on the screen, from the canvas's upper left corner. */
export class Gestures {
  band: Rectangle | null = null;
  cursor = ""; // CSS, by what the pointer would do
  pulled: { from: Point; to: Point; fits: Port[] } | null = null;
  border: Point | null = null; // of a state, under the pointer
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
    const grip = this.grip_at(press), wrong = this.badge_at(press);
    if (press.button === 1 || press.is_panning || (press.is_touch && !found)) this.gesture = { kind: "pan", last: press };
    else if (press.button !== 0) return;
    else if (wrong) {
      s.select([key_of(wrong)]);
      s.dialog = { kind: "fix" };
    } else if (found?.port) {
      s.choose_port({ element: found.element, port: found.port });
      this.pull(found.element, found.port);
    }
    else if (found?.border) {
      s.select([key_of(found.element)]);
      this.pull(found.element, { ...found.element.ports.find((port) => port.is_output)!, at: found.border });
    }
    else if (grip) this.gesture = { kind: "resize", from: point, ...grip, tried: null };
    else if (found) {
      const key = key_of(found.element);
      if (press.shift) s.toggle(key);
      else if (!s.selection.has(key)) s.select([key]);
      s.begin_drag();
      this.gesture = { kind: "move", from: point, delta: { x: 0, y: 0 }, is_moving: false, pressed: found.element, shift: press.shift,
        before: s.drawing!, into: null };
    } else {
      if (!press.shift) s.select([]);
      this.gesture = { kind: "band", from: point, before: s.selection };
    }
  }

  /** What a badge stands at, where something would mend its mistake. */
  private badge_at(p: Point): Element | null {
    const { drawing, view } = this.session, at = this.point(p);
    return drawing?.elements.find((e) => {
      const badge = badge_of(e);
      return e.marks.some((mark) => mark.fixes.length > 0) && Math.hypot(badge.x - at.x, badge.y - at.y) * view.scale < 8;
    }) ?? null;
  }
  /** A handle of the one chosen block. */
  grip_at(p: Point): { block: Element; handle: Handle } | null {
    const { chosen, view } = this.session, block = chosen.length === 1 ? chosen[0]! : null, at = this.point(p);
    const grip = block && grips(block, view.scale).find((one) => Math.hypot(one.at.x - at.x, one.at.y - at.y) * view.scale < reach);
    return grip ? { block, handle: grip.handle } : null;
  }

  private cursor_at(p: Point, found: Hit | null): string {
    if (this.badge_at(p)) return "pointer";
    if (found?.port || found?.border) return "crosshair";
    const grip = this.grip_at(p)?.handle;
    if (grip) return grip.x === 0 ? "ns-resize" : grip.y === 0 ? "ew-resize" : grip.x === grip.y ? "nwse-resize" : "nesw-resize";
    if (found?.element.kind !== "wire" || found.element.corners.length < 2) return "";
    return axis_of(found.element.corners, nearest_piece(this.point(p), found.element.corners)) === "x" ? "ns-resize" : "ew-resize";
  }

  /** A wire grows from a port; from an input that has one, its end comes loose. */
  private pull(element: Element, port: Port): void {
    const elements = this.session.drawing!.elements;
    const ends = [`${element.path}.${port.name}`, element.path];
    const loose = port.is_output || !port.is_wired ? undefined
      : elements.find((e) => e.kind === "wire" && ends.includes(e.path));
    const source = loose && this.source_of(loose);
    const end = source ?? { element, port };
    this.gesture = { kind: "pull", end, loose: source ? loose! : null, from: end.port.at, has_left: false };
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
      const cursor = this.cursor_at(at, found), border = found?.border ?? null, is_other = cursor !== this.cursor || border !== this.border;
      this.cursor = cursor;
      this.border = border;
      if (is_other) this.repaint();
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
      g.has_left ||= !over || over.element.path !== g.end.element.path;
    } else if (g.kind === "bend") {
      const across = axis_of(g.wire.corners, g.piece) === "x" ? "y" : "x", start = g.wire.corners[g.piece]![across];
      g.tried = s.try_bend(g.before, g.wire, g.piece, on(start, point[across] - g.from[across], is_free));
    } else if (g.kind === "resize") {
      const { block: { bounds }, handle } = g, corner = handle_at(bounds, handle);
      g.tried = s.try_size(g.block, handle, { x: on(corner.x, point.x - g.from.x, is_free), y: on(corner.y, point.y - g.from.y, is_free) });
    } else {
      this.drag(g, point, is_free);
    }
    this.repaint();
  }
  private may_join(g: Extract<Gesture, { kind: "pull" }>, other: End): boolean {
    const is_own = g.loose && [`${other.element.path}.${other.port.name}`, other.element.path].includes(g.loose.path);
    const is_other = other.element.path !== g.end.element.path || (g.has_left && other.element.kind === "state"); // a state may lead to itself
    return is_other && (fits(g.end.port, other.port) || (is_own === true && !other.port.is_output));
  }
  private drag(g: Extract<Gesture, { kind: "move" }>, point: Point, is_free: boolean): void {
    const s = this.session, first = s.dragged[0];
    if (!g.is_moving && Math.hypot(point.x - g.from.x, point.y - g.from.y) * s.view.scale < 4) return;
    g.is_moving = true;
    if (!first && g.pressed.kind === "wire" && !g.pressed.as_labels && !g.shift) {
      const piece = nearest_piece(g.from, g.pressed.corners);
      this.gesture = { kind: "bend", from: g.from, before: g.before, wire: g.pressed, piece, tried: [] };
    }
    if (!first) return;
    g.delta = { x: on(first.bounds.x, point.x - g.from.x, is_free), y: on(first.bounds.y, point.y - g.from.y, is_free) };
    const middle = centre(first.bounds), over = { x: middle.x + g.delta.x, y: middle.y + g.delta.y };
    const ports = s.dragged.length === 1 ? through(first) : null;
    g.into = ports && this.wire_under(g.before, over);
    if (g.into && ports) { // its input comes to lie on the wire
      const piece = nearest_piece(over, g.into.corners);
      if (!g.into.as_labels && axis_of(g.into.corners, piece) === "x") g.delta.y = g.into.corners[piece]!.y - ports.input.at.y;
    }
    s.hovered = key_of(g.into ?? g.pressed);
    void s.redraw(s.moves(g.delta));
  }
  /** Where something that is let go at a point goes into a wire. */
  wire_under(drawing: Drawing | null, p: Point): Element | null { return drawing && wire_at(drawing, p, 12); }

  async up(at: Point): Promise<void> {
    const s = this.session, g = this.gesture, found = this.at(at), point = this.point(at);
    this.gesture = this.band = this.pulled = this.border = null;
    this.repaint();
    if (g?.kind === "move") {
      if (g.is_moving && s.dragged.length > 0) await s.drop(g.delta, g.into);
      else if (!g.is_moving) this.click(g);
    } else if (g?.kind === "bend") {
      await s.bend(g.tried);
    } else if (g?.kind === "resize") {
      if (g.tried) await s.resize(g.tried);
    } else if (g?.kind === "pull") {
      await this.end_pull(g, found, point);
    }
  }
  private click(g: Extract<Gesture, { kind: "move" }>): void {
    const s = this.session;
    if (g.shift) return;
    s.select([key_of(g.pressed)]);
    if (g.pressed.kind === "wire" && !s.is_chart && s.run.state !== "none") s.watch(s.source_of(g.pressed));
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
    if (this.gesture) this.session.let_go();
    this.gesture = this.band = this.pulled = null;
    this.repaint();
    return was;
  }

  /** A menu is about what lies there, with all else that is chosen if that is. */
  menu(at: Point): void {
    const s = this.session, found = this.at(at);
    s.cursor = this.point(at);
    if (!found) s.select([]);
    else if (found.port) s.choose_port({ element: found.element, port: found.port });
    else if (!s.selection.has(key_of(found.element))) s.select([key_of(found.element)]);
    s.open_menu(at);
  }

  twice(at: Point): void {
    const s = this.session, found = this.at(at);
    if (!found) s.dialog = { kind: "search", at: this.point(at) };
    else if (found.element.kind === "wire" && !s.is_chart) s.dialog = { kind: "search", at: this.point(at), into: found.element };
    else if (found.element.kind === "note" || (found.element.kind === "state" && !may_enter(found.element))) s.renamed = key_of(found.element);
    else if (found.port) return;
    else if (found.is_name || !may_enter(found.element)) s.renamed = found.is_name ? key_of(found.element) : null;
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
  const { element, port, border } = found;
  if (border) return [element.title, "drag from its border to another state: a transition"];
  if (port) return [`${last_of(element.path)}.${port.name}`, port.about].filter(Boolean);
  return [element.title, element.description, ...element.marks.flatMap((m) => [`⚠ ${m.message}`, m.remedy])].filter(Boolean);
}

