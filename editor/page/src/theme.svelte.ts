import { choose, chosen, colours, type Choice, type Colours } from "./theme.ts";

/** Light or dark, as the person or the system chose, and its colours. */
export class Theme {
  choice = $state<Choice>(chosen());
  colours = $state.raw<Colours>(colours());

  next(): void {
    this.choice = this.choice === "system" ? "light" : this.choice === "light" ? "dark" : "system";
    choose(this.choice);
    this.refresh();
  }
  /** After the style sheet changed what it says. */
  refresh(): void { this.colours = colours(); }
}
