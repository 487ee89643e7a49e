import type { Element, Point, Port } from "./protocol.ts";

export interface End { element: Element; port: Port }
/** What a menu is about. */
export type Target = "block" | "wire" | "port" | "note" | "empty";
/** What a person is asked for. */
export type Dialog =
  | { kind: "search"; at?: Point; into?: Element } // all that one can insert or do; what goes into a wire
  | { kind: "insert"; at: Point; from?: End }     // with a wire from there
  | { kind: "connect" }
  | { kind: "find" }                              // something in the whole model
  | { kind: "fix" }                               // what would mend mistakes
  | { kind: "plots" }                             // of the model, for the chosen signal
  | { kind: "open" }
  | { kind: "image"; at?: Point }
  | { kind: "recording" }             // to draw beside the run
  | { kind: "earlier" }               // what to compare the model with
  | { kind: "compare"; file: string } // empty: the last commit
  | { kind: "help" };
