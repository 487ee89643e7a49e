#pragma once

#include "bf/kernels/convert.hpp"
#include "bf/kernels/lookup.hpp"

/// Zero-crossing functions: g crosses zero, or changes where it is a whole number, where a signal of another
/// kernel jumps or has a corner.
namespace bf::kernels {

/// g = u - level: crosses zero where u passes the level.
struct Margin {
    static constexpr const char* name = "bf::kernels::Margin{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class U, class L>
    constexpr void operator()(const G& g, const U& u, const L& level) const noexcept {
        for (int i = 0; i < g.size(); ++i)
            g[i] = static_cast<Element<G>>(u[pick(i, u.size())]) -
                   static_cast<Element<G>>(level[pick(i, level.size())]);
    }
};

/// g = 1 where u > 0, else -1: crosses zero also where u jumps from 0.
struct PositiveSign {
    static constexpr const char* name = "bf::kernels::PositiveSign{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class U> constexpr void operator()(const G& g, const U& u) const noexcept {
        for (int i = 0; i < g.size(); ++i) g[i] = u[pick(i, u.size())] > 0 ? 1 : -1;
    }
};

/// Crosses zero where u meets a stop of a play: u - x ∓ width/2, x being the output of the step before.
struct StopMargins {
    static constexpr const char* name = "bf::kernels::StopMargins{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class L, class H, class W, class X, class U>
    constexpr void operator()(const L& lower, const H& upper, const W& width, const X& x,
                              const U& u) const noexcept {
        for (int i = 0; i < lower.size(); ++i) {
            using T = Element<L>;
            const T half = static_cast<T>(width[pick(i, width.size())]) / T(2);
            const T offset = static_cast<T>(u[i]) - static_cast<T>(x[i]);
            lower[i] = offset + half;
            upper[i] = offset - half;
        }
    }
};

/// g counts the steps of a quantizer: round(u / q).
struct QuantizeEdges {
    static constexpr const char* name = "bf::kernels::QuantizeEdges{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class G, class Q, class U>
    void operator()(const G& g, const Q& interval, const U& u) const noexcept {
        for (int i = 0; i < g.size(); ++i)
            g[i] = detail::counted(round(u[pick(i, u.size())] / interval[pick(i, interval.size())]));
    }
};

/// g = u without its fraction: changes wherever a choice by a number does.
struct WholeNumber {
    static constexpr const char* name = "bf::kernels::WholeNumber{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class U> void operator()(const G& g, const U& u) const noexcept {
        for (int i = 0; i < g.size(); ++i) g[i] = detail::counted(detail::whole(u[pick(i, u.size())]));
    }
};

/// g = u rounded, options = [rounding]: changes wherever the rounded value jumps. Integers have no fraction.
struct RoundingEdges {
    static constexpr const char* name = "bf::kernels::RoundingEdges{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class O, class U>
    void operator()(const G& g, const O& options, const U& u) const noexcept {
        const auto rounding = static_cast<Rounding>(static_cast<int>(options[0]));
        for (int i = 0; i < g.size(); ++i)
            g[i] = detail::counted(rounded(static_cast<double>(u[pick(i, u.size())]), rounding));
    }
};

/// g = a/b rounded, options = [rounding]: changes wherever the remainder that is left jumps.
struct QuotientEdges {
    static constexpr const char* name = "bf::kernels::QuotientEdges{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class G, class O, class A, class B>
    void operator()(const G& g, const O& options, const A& a, const B& b) const noexcept {
        const auto rounding = static_cast<Rounding>(static_cast<int>(options[0]));
        for (int i = 0; i < g.size(); ++i)
            g[i] = detail::counted(
                rounded(static_cast<double>(a[pick(i, a.size())]) / static_cast<double>(b[pick(i, b.size())]),
                        rounding));
    }
};

namespace detail {
/// Is the point (b, a) in the third quadrant? The angle atan2(a, b) jumps where the point enters it from
/// above. It does not where the point leaves below, but no function of the plane jumps at that ray alone.
template <class T> constexpr std::int32_t third_quadrant(T a, T b) noexcept { return a < T(0) && b < T(0); }
} // namespace detail

/// g = 1 where the point (b, a) is in the third quadrant, else 0: changes where its angle jumps.
struct AngleEdge {
    static constexpr const char* name = "bf::kernels::AngleEdge{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class G, class A, class B>
    constexpr void operator()(const G& g, const A& a, const B& b) const noexcept {
        for (int i = 0; i < g.size(); ++i)
            g[i] = detail::third_quadrant<double>(a[pick(i, a.size())], b[pick(i, b.size())]);
    }
};

/// g = sign of u where that is a single number, else 0: changes where √(Σ u_i²) has its corner. A longer u
/// meets 0 only where all its elements do, which no function of them tells by its sign alone.
struct SideOfNumber {
    static constexpr const char* name = "bf::kernels::SideOfNumber{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class G, class U> constexpr void operator()(const G& g, const U& u) const noexcept {
        g[0] = u.size() == 1 ? (u[0] > 0) - (u[0] < 0) : 0;
    }
};

/// g = ±k for the element k (from 1) that is farthest from 0, with its sign: changes where max |u_i| has a
/// corner.
struct FarthestElement {
    static constexpr const char* name = "bf::kernels::FarthestElement{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class G, class U> constexpr void operator()(const G& g, const U& u) const noexcept {
        int farthest = 0;
        for (int i = 1; i < u.size(); ++i)
            if (fabs(u[i]) > fabs(u[farthest])) farthest = i;
        g[0] = u.size() == 0 ? 0 : u[farthest] < 0 ? -farthest - 1 : farthest + 1;
    }
};

/// g = number of the smallest element, or with signs = [-1] of the largest one: changes where the extreme
/// passes from one to another.
struct ExtremeElement {
    static constexpr const char* name = "bf::kernels::ExtremeElement{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class S, class U>
    constexpr void operator()(const G& g, const S& signs, const U& u) const noexcept {
        int k = 0;
        for (int i = 1; i < u.size(); ++i)
            if (signs[0] * static_cast<double>(u[i]) < signs[0] * static_cast<double>(u[k])) k = i;
        g[0] = k;
    }
};

/// The same of several operands, element by element.
struct ExtremeOperand {
    static constexpr const char* name = "bf::kernels::ExtremeOperand{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class G, class S, class L>
    constexpr void operator()(const G& g, const S& signs, const L& u) const noexcept {
        for (int i = 0; i < g.size(); ++i) {
            const auto height = [&](int k) {
                return signs[0] * static_cast<double>(u[k][pick(i, u[k].size())]);
            };
            int k = 0;
            for (int other = 1; other < u.size(); ++other)
                if (height(other) < height(k)) k = other;
            g[i] = k;
        }
    }
};

/// g = number of the piece of a table that u stands in: changes where the table's value jumps or has a
/// corner. options = [interpolation clips], as of Lookup.
struct TablePiece {
    static constexpr const char* name = "bf::kernels::TablePiece{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class G, class O, class X, class U>
    void operator()(const G& g, const O& options, const X& x, const U& u) const noexcept {
        const auto how = static_cast<Interpolation>(static_cast<int>(options[0]));
        const int n = x.size();
        for (int j = 0; j < g.size(); ++j) {
            const auto at = static_cast<Element<X>>(u[pick(j, u.size())]);
            const int k = interval(&x[0], n, at, 0);
            const int above = at >= x[n - 1], below = at < x[0];
            if (n < 2)
                g[j] = 0;
            else if (how == Interpolation::flat)
                g[j] = k + above;
            else if (how == Interpolation::nearest)
                g[j] = k + (fraction(&x[0], n, k, at, true) >= Element<X>(0.5));
            else
                g[j] = options[1] != 0 ? k + above - below : k;
        }
    }
};

} // namespace bf::kernels
