// Arithmetic of the standard blocks that joins kernels; generated code includes it like any kernel.
#pragma once

#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/routing.hpp"

namespace bf::kernels {

/// y = a b, where a scalar operand scales the other one.
struct ScalarOrMatrixProduct {
    static constexpr const char* name = "bf::kernels::ScalarOrMatrixProduct{}";
    static constexpr bool chooses_registers = true;
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        if (a.size() == 1 || b.size() == 1)
            Multiply{}(y, a, b);
        else
            MatrixProduct{}(y, a, b);
    }
};

/// y_j = table(row, j): one row of a matrix, counted from 1. False outside; y is 0 then.
struct LookUpRow {
    static constexpr const char* name = "bf::kernels::LookUpRow{}";
    static constexpr char failure[] = "the row asked for is not in the table";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class M, class R>
    constexpr bool operator()(const Y& y, const M& table, const R& row) const noexcept {
        const int i = detail::place(row[0], table.rows);
        const bool inside = i >= 0;
        for (int j = 0; j < y.size(); ++j) y[j] = inside ? table(i, j) : Element<Y>(0);
        return inside;
    }
};

/// False when an element of u is 0.
struct Assert {
    static constexpr const char* name = "bf::kernels::Assert{}";
    static constexpr char failure[] = "the asserted condition does not hold";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class U> constexpr bool operator()(const U& u) const noexcept {
        bool holds = true;
        for (int i = 0; i < u.size(); ++i) holds = holds && u[i] != 0;
        return holds;
    }
};

/// y = x + (u ≠ 0), or 0 while reset ≠ 0.
struct Count {
    static constexpr const char* name = "bf::kernels::Count{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U, class R>
    constexpr void operator()(const Y& y, const X& x, const U& u, const R& reset) const noexcept {
        using T = Element<Y>;
        y[0] = reset[0] != 0 ? T(0) : u[0] != 0 ? x[0] + T(1) : x[0];
    }
};

/// since = for how long [s] u has been true, this step included; y = u and since > duration. A step of
/// rounding is forgiven.
struct OnDelay {
    static constexpr const char* name = "bf::kernels::OnDelay{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S, class D, class P, class X, class U>
    constexpr void operator()(const Y& y, const S& since, const D& duration, const P& period, const X& before,
                              const U& u) const noexcept {
        since[0] = u[0] != 0 ? before[0] + period[0] : Element<S>(0);
        y[0] = u[0] != 0 && before[0] >= duration[0] - Element<P>(1e-6) * period[0];
    }
};

/// y: element `which` of the list, from 0, is the first one that is true; after the last one: none is.
struct IsFirst {
    static constexpr const char* name = "bf::kernels::IsFirst{}";
    template <class Y, class W, class U>
    constexpr void operator()(const Y& y, const W& which, const U& u) const noexcept {
        int first = 0;
        while (first < u.size() && !u[first][0]) ++first;
        y[0] = first == static_cast<int>(which[0]);
    }
};

/// y: element `which` of the cases, from 0, is the first one that equals u, cut to a whole number; after the
/// last one: none does.
struct IsCase {
    static constexpr const char* name = "bf::kernels::IsCase{}";
    template <class Y, class W, class C, class U>
    constexpr void operator()(const Y& y, const W& which, const C& cases, const U& u) const noexcept {
        int first = 0;
        while (first < cases.size() && cases[first] != trunc(u[0])) ++first;
        y[0] = first == static_cast<int>(which[0]);
    }
};

/// y is true at every time.
struct AlwaysTrue {
    static constexpr const char* name = "bf::kernels::AlwaysTrue{}";
    template <class Y, class T> constexpr void operator()(const Y& y, const T&) const noexcept {
        y[0] = true;
    }
};

enum class CheckKind { always, final, maximum, minimum, rms, mean };

/// Summary of u over the samples from `from_time` on: value and the sum and count behind it; passed = value
/// within the limits. rms and mean are over samples, rms of the Euclidean norm, mean of all elements.
template <CheckKind kind> struct Check {
    static constexpr const char* names[6] = {"bf::kernels::Check<bf::kernels::CheckKind::always>{}",
                                             "bf::kernels::Check<bf::kernels::CheckKind::final>{}",
                                             "bf::kernels::Check<bf::kernels::CheckKind::maximum>{}",
                                             "bf::kernels::Check<bf::kernels::CheckKind::minimum>{}",
                                             "bf::kernels::Check<bf::kernels::CheckKind::rms>{}",
                                             "bf::kernels::Check<bf::kernels::CheckKind::mean>{}"};
    static constexpr const char* name = names[static_cast<int>(kind)];
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class V, class P, class S, class N, class V0, class P0, class S0, class N0, class F, class L,
              class H, class T, class U>
    void operator()(const V& value, const P& passed, const S& sum, const N& count, const V0& old_value,
                    const P0& old_passed, const S0& old_sum, const N0& old_count, const F& from_time,
                    const L& at_least, const H& at_most, const T& time, const U& u) const noexcept {
        value[0] = old_value[0];
        passed[0] = old_passed[0];
        using Number = Element<V>;
        sum[0] = old_sum[0];
        count[0] = old_count[0];
        if (time[0] < from_time[0] || u.size() == 0) return;
        const bool is_first = count[0] == 0;
        count[0] += 1;
        if constexpr (kind == CheckKind::always) {
            bool holds = is_first || value[0] != 0;
            for (int i = 0; i < u.size(); ++i) holds = holds && u[i] != 0;
            value[0] = holds ? 1 : 0;
        } else if constexpr (kind == CheckKind::final) {
            value[0] = static_cast<Number>(u[0]);
        } else if constexpr (kind == CheckKind::maximum || kind == CheckKind::minimum) {
            // NaN stays once it was seen: a check must not overlook it.
            for (int i = 0; i < u.size(); ++i) {
                const auto x = static_cast<Number>(u[i]);
                const bool replaces = kind == CheckKind::maximum ? x > value[0] : x < value[0];
                if ((is_first && i == 0) || replaces || x != x) value[0] = x;
            }
        } else {
            for (int i = 0; i < u.size(); ++i) {
                const auto x = static_cast<Number>(u[i]);
                sum[0] += kind == CheckKind::rms ? x * x : x / static_cast<Number>(u.size());
            }
            const Number mean = sum[0] / count[0];
            value[0] = kind == CheckKind::rms ? sqrt(mean) : mean;
        }
        passed[0] = value[0] >= at_least[0] && value[0] <= at_most[0];
        if constexpr (kind == CheckKind::always) passed[0] = passed[0] && value[0] != 0;
    }
};

} // namespace bf::kernels
