import { badge_of, key_of, longest_piece, meets, middle_of, to_screen, wire_line, type Size, type View } from "./geometry.ts";
import { grips, handle_at, handles } from "./layout.ts";
import { joined } from "./operations.ts";
import type { Drawing, Element, Point, Port, Rectangle, Shape } from "./protocol.ts";
import { font, rate_colour, text_colour, type Colours } from "./theme.ts";

/** What the page adds to the display list. */
export interface Look {
  selection: ReadonlySet<string>;
  hovered: string | null;
  band: Rectangle | null;
  /** A wire that is being drawn: from a port to the pointer, and the ports it may end at. */
  pulled: { from: Point; to: Point; fits: Port[] } | null;
  border: Point | null; // of a state, where a transition would begin
  /** Of each watched source the elements of its value, which stands on its first wire. */
  values: ReadonlyMap<string, string[]>;
  /** Numbers of the active states. */
  active: ReadonlySet<number>;
  port: Port | null; // that is chosen alone
  image(address: string): HTMLImageElement | null;
  by_rate: boolean;
  colours: Colours;
}

interface Brush { context: CanvasRenderingContext2D; view: View; ratio: number; look: Look }

/** Lengths on the screen that should not vanish when one zooms out, nor grow as fast as the drawing. */
const thickness = (view: View, width: number) => Math.max(0.6, width * Math.min(Math.max(view.scale, 0.5), 2.5));

/** Horizontal and vertical lines fall on whole pixels of the device. */
function trace({ context, view, ratio }: Brush, points: Point[], is_sharp: boolean): void {
  points.forEach((point, i) => {
    let { x, y } = to_screen(view, point);
    if (is_sharp) [x, y] = [(Math.round(x * ratio) + 0.5) / ratio, (Math.round(y * ratio) + 0.5) / ratio];
    if (i === 0) context.moveTo(x, y);
    else context.lineTo(x, y);
  });
}

function outline(brush: Brush, shape: Shape): void {
  const { context, view } = brush, points = shape.points;
  context.beginPath();
  if (shape.kind === "ellipse" && points.length === 2) {
    const [a, b] = [to_screen(view, points[0]!), to_screen(view, points[1]!)];
    context.ellipse((a.x + b.x) / 2, (a.y + b.y) / 2, Math.abs(b.x - a.x) / 2, Math.abs(b.y - a.y) / 2, 0, 0, 2 * Math.PI);
  } else if (shape.kind === "curve") {
    trace(brush, points.slice(0, 1), false);
    for (let i = 1; i + 2 < points.length; i += 3) {
      const [a, b, end] = [to_screen(view, points[i]!), to_screen(view, points[i + 1]!), to_screen(view, points[i + 2]!)];
      context.bezierCurveTo(a.x, a.y, b.x, b.y, end.x, end.y);
    }
  } else {
    trace(brush, points, shape.style === "body" || shape.style === "wire");
    if (shape.kind === "polygon") context.closePath();
  }
}

function draw_text({ context, view, look }: Brush, shape: Shape): void {
  const size = shape.size * view.scale, at = to_screen(view, shape.points[0] ?? { x: 0, y: 0 });
  if (size < 3) return;
  context.font = `${shape.style === "note" ? "italic " : ""}${size}px ${font}`;
  context.textAlign = shape.align === "middle" ? "center" : shape.align;
  context.fillStyle = text_colour(look.colours, shape.style);
  if (shape.style === "name" || shape.style === "label") { // what a wire crosses is still read
    context.strokeStyle = look.colours.canvas;
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeText(shape.text, at.x, at.y);
  }
  context.fillText(shape.text, at.x, at.y);
}

/** As large as fits into its place. */
function draw_image({ context, view, look }: Brush, shape: Shape): void {
  const image = look.image(shape.text), a = to_screen(view, shape.points[0]!), b = to_screen(view, shape.points[1]!);
  if (!image) return;
  const [natural_width, natural_height] = [image.naturalWidth || b.x - a.x, image.naturalHeight || b.y - a.y];
  const by = Math.min((b.x - a.x) / natural_width, (b.y - a.y) / natural_height), width = by * natural_width, height = by * natural_height;
  context.drawImage(image, (a.x + b.x - width) / 2, (a.y + b.y - height) / 2, width, height);
}

function draw_shape(brush: Brush, shape: Shape, element: Element): void {
  const { context, view, look } = brush, c = look.colours;
  if (shape.kind === "text") return draw_text(brush, shape);
  if (shape.kind === "image") return draw_image(brush, shape);
  const key = key_of(element), is_chosen = look.selection.has(key), is_live = is_chosen || look.hovered === key;
  const is_active = element.state !== null && look.active.has(element.state);
  const own = is_active ? c.accent : look.by_rate && element.rate !== null ? rate_colour(element.rate) : null;
  outline(brush, shape);
  context.lineJoin = context.lineCap = "round";
  if (shape.style === "body") {
    context.fillStyle = c.body;
    if (shape.kind !== "line") context.fill();
    if (is_active) {
      context.fillStyle = c["accent-soft"];
      context.fill();
    }
    context.strokeStyle = is_live ? c.accent : own ?? c["body-line"];
    context.lineWidth = thickness(view, is_active ? 2.5 : is_chosen ? 1.8 : 1.2);
    context.stroke();
  } else if (shape.style === "branch" || (shape.style === "wire" && (shape.kind === "polygon" || shape.kind === "ellipse"))) {
    context.fillStyle = is_live ? c.accent : own ?? c[shape.style];
    context.fill();
  } else {
    context.fillStyle = c.canvas;
    if (shape.style === "open") context.fill();
    context.strokeStyle = shape.style !== "wire" ? c[shape.style] : is_live ? c.accent : own ?? c.wire;
    context.lineWidth = thickness(view, shape.style === "highlight" ? 2 : shape.style === "wire" && is_chosen ? 2.2 : 1.3);
    context.stroke();
  }
}

function round_box(context: CanvasRenderingContext2D, r: Rectangle, radius: number): void {
  context.beginPath();
  context.roundRect(r.x, r.y, r.width, r.height, radius);
}

function screen_box(view: View, r: Rectangle, by: number): Rectangle {
  const { x, y } = to_screen(view, r);
  return { x: x - by, y: y - by, width: r.width * view.scale + 2 * by, height: r.height * view.scale + 2 * by };
}

function draw_badge({ context, view, look }: Brush, element: Element): void {
  const at = to_screen(view, badge_of(element));
  context.beginPath();
  context.arc(at.x, at.y, 7, 0, 2 * Math.PI);
  context.fillStyle = look.colours.highlight;
  context.fill();
  context.fillStyle = look.colours.canvas;
  context.font = `bold 11px ${font}`;
  context.textAlign = "center";
  context.fillText("!", at.x, at.y + 4);
}

function draw_port({ context, view, look }: Brush, place: Point, is_target: boolean): void {
  const at = to_screen(view, place);
  context.beginPath();
  context.arc(at.x, at.y, is_target ? 6 : 4, 0, 2 * Math.PI);
  context.fillStyle = is_target ? look.colours["accent-soft"] : look.colours.canvas;
  context.fill();
  context.strokeStyle = look.colours.accent;
  context.lineWidth = 1.5;
  context.stroke();
}

/** Where wires begin and end; at a state that is anywhere on its border, which the middles of its sides tell. */
const places_of_ports = ({ kind, bounds, ports }: Element): Point[] =>
  (kind === "state" ? handles.filter(({ x, y }) => x === 0 || y === 0).map((handle) => handle_at(bounds, handle)) : ports.map(({ at }) => at));

/** What a person takes to resize a block or to bend a wire. */
function draw_handles({ context, view, look }: Brush, element: Element): void {
  const points = element.kind === "wire" ? element.corners.slice(1).map((p, i) => middle_of([element.corners[i]!, p]))
    : grips(element, view.scale).map(({ at }) => at);
  context.fillStyle = look.colours.canvas;
  context.strokeStyle = look.colours.accent;
  context.lineWidth = 1;
  for (const point of points) {
    const { x, y } = to_screen(view, point);
    context.beginPath();
    context.rect(Math.round(x) - 2.5, Math.round(y) - 2.5, 5, 5);
    context.fill();
    context.stroke();
  }
}

/** On the wire, as much of it as has room there; all of it where the pointer is. */
function draw_value({ context, view, look }: Brush, wire: Element, words: string[], is_whole: boolean): void {
  const [from, to] = longest_piece(wire_line(wire)), at = to_screen(view, middle_of([from, to]));
  if (wire.shapes.some((shape) => shape.kind === "text")) at.y += 11; // beneath its name, or its label
  context.font = `600 11px ${font}`;
  const width_of = (count: number) => context.measureText(text_of(count)).width + 10;
  const text_of = (count: number) => (words.length === 1 ? words[0]! : `[${words.slice(0, count).join(" ")}${count < words.length ? " …" : ""}]`);
  const room = is_whole ? Infinity : Math.abs(to.x - from.x) * view.scale + 12; // into the margins of blocks
  let count = words.length;
  while (count > 0 && width_of(count) > room) --count;
  const width = count > 0 ? width_of(count) : 8, height = count > 0 ? 16 : 8;
  round_box(context, { x: at.x - width / 2, y: at.y - height / 2, width, height }, height / 2);
  context.fillStyle = look.colours.pill;
  context.fill();
  if (count === 0) return;
  context.fillStyle = look.colours["pill-text"];
  context.textAlign = "center";
  context.fillText(text_of(count), at.x, at.y + 4);
}

function draw_dots({ context, view, look }: Brush, size: Size): void {
  const step = 20 * view.scale;
  if (step < 12) return;
  context.fillStyle = look.colours.dots;
  const first = to_screen(view, { x: Math.ceil(view.x / 20) * 20, y: Math.ceil(view.y / 20) * 20 });
  for (let x = first.x; x < size.width; x += step)
    for (let y = first.y; y < size.height; y += step) context.fillRect(Math.round(x), Math.round(y), 1, 1);
}

export function paint(context: CanvasRenderingContext2D, drawing: Drawing | null, view: View, size: Size, ratio: number, look: Look): void {
  const brush: Brush = { context, view, ratio, look }, c = look.colours;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = c.canvas;
  context.fillRect(0, 0, size.width, size.height);
  draw_dots(brush, size);
  if (!drawing) return;
  const seen: Rectangle = { x: view.x - 60, y: view.y - 60, width: size.width / view.scale + 120, height: size.height / view.scale + 120 };
  const visible = drawing.elements.filter((element) => meets(seen, element.bounds));
  for (const element of visible) {
    if (element.kind !== "wire" && look.selection.has(key_of(element))) {
      round_box(context, screen_box(view, element.bounds, 4), 5);
      context.fillStyle = c["accent-soft"];
      context.fill();
    }
    for (const shape of element.shapes) draw_shape(brush, shape, element);
  }
  const labelled = new Set<string>();
  for (const element of visible) {
    const source = joined(drawing.system, element.from);
    const value = element.kind === "wire" && !labelled.has(source) ? look.values.get(source) : undefined;
    if (value !== undefined) draw_value(brush, element, value, false);
    if (value !== undefined) labelled.add(source);
    if (element.marks.length > 0) draw_badge(brush, element);
    if (element.kind !== "wire" && key_of(element) === look.hovered && !look.pulled)
      for (const place of places_of_ports(element)) draw_port(brush, place, false);
  }
  if (look.port) draw_port(brush, look.port.at, true);
  if (look.border) draw_port(brush, look.border, true);
  const pointed = visible.find((element) => element.kind === "wire" && key_of(element) === look.hovered);
  const whole = pointed && look.values.get(joined(drawing.system, pointed.from));
  if (whole) draw_value(brush, pointed, whole, true);
  if (look.selection.size === 1)
    for (const element of visible) if (look.selection.has(key_of(element))) draw_handles(brush, element);
  if (look.pulled) {
    for (const port of look.pulled.fits) draw_port(brush, port.at, true);
    context.beginPath();
    trace(brush, [look.pulled.from, look.pulled.to], false);
    context.strokeStyle = c.accent;
    context.lineWidth = 1.8;
    context.setLineDash([6, 4]);
    context.stroke();
    context.setLineDash([]);
  }
  if (look.band) {
    const { x, y } = to_screen(view, look.band);
    context.fillStyle = c["accent-soft"];
    context.strokeStyle = c.accent;
    context.lineWidth = 1;
    context.beginPath();
    context.rect(x, y, look.band.width * view.scale, look.band.height * view.scale);
    context.fill();
    context.stroke();
  }
}

