// The colours of a drawing, light and dark.
#pragma once

#include "bf/view/drawing.hpp"

namespace bf::editor {

inline constexpr const char *light_paper = "#ffffff", *dark_paper = "#17191d";

/// How shapes of a style are drawn: lines in `light` or `dark`, `width` pixels wide, texts in the same
/// colour.
struct Ink {
    Style style;
    const char *light, *dark;
    const char *light_fill = "", *dark_fill = ""; ///< of closed shapes; empty: none
    double width = 1.3;
};

/// In the order of Style.
inline constexpr Ink theme[] = {{Style::body, "#3a424e", "#97a1b0", "#ffffff", "#242830"},
                                {Style::symbol, "#3a424e", "#c3cad4"},
                                {Style::value, "#1d2127", "#e4e7eb"},
                                {Style::name, "#5c6470", "#a3abb7"},
                                {Style::port, "#5c6470", "#a3abb7"},
                                {Style::open, "#5c6470", "#a3abb7", "#ffffff", "#17191d"},
                                {Style::wire, "#3a424e", "#b4bcc8"},
                                {Style::branch, "#3a424e", "#b4bcc8", "#3a424e", "#b4bcc8"},
                                {Style::label, "#6b5b95", "#b8a6e8"},
                                {Style::note, "#5c6470", "#a3abb7"},
                                {Style::highlight, "#d6453a", "#ff7b6e", "", "", 2},
                                {Style::added, "#1a8f4c", "#4fd08a", "", "", 2},
                                {Style::removed, "#d6453a", "#ff7b6e", "", "", 2},
                                {Style::changed, "#c07a00", "#f0b040", "", "", 2}};

/// The word for a style: "body", "wire".
const char* name(Style style);

} // namespace bf::editor
