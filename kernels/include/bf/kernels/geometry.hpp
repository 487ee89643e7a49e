#pragma once

#include "bf/kernels/functions.hpp"
#include "bf/kernels/reduce.hpp"

/// Rotations and poses. A rotation R is 3 × 3, orthogonal with determinant 1 (not checked); a pose is 4 × 4,
/// H = [R p; 0 1]; a quaternion is [w x y z]; angles are in rad. Outputs share no memory with
/// inputs. Reference: Siciliano, Sciavicco, Villani, Oriolo, Robotics: Modelling, Planning and Control,
/// ch. 2.
namespace bf::kernels {

namespace detail {

/// The rotation by `angle` in the plane of the axes p, q, which turns p towards q.
template <class R, class A> void rotation_in_plane(const R& r, const A& angle, int p, int q) noexcept {
    const auto c = Cos::apply(angle[0]), s = Sin::apply(angle[0]);
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) r(i, j) = i == j ? 1 : 0;
    r(p, p) = c;
    r(q, q) = c;
    r(q, p) = s;
    r(p, q) = -s;
}

} // namespace detail

/// R = rotation about the x axis.
struct RotationX {
    static constexpr const char* name = "bf::kernels::RotationX{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class A> void operator()(const R& r, const A& angle) const noexcept {
        detail::rotation_in_plane(r, angle, 1, 2);
    }
};

/// R = rotation about the y axis.
struct RotationY {
    static constexpr const char* name = "bf::kernels::RotationY{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class A> void operator()(const R& r, const A& angle) const noexcept {
        detail::rotation_in_plane(r, angle, 2, 0);
    }
};

/// R = rotation about the z axis.
struct RotationZ {
    static constexpr const char* name = "bf::kernels::RotationZ{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class A> void operator()(const R& r, const A& angle) const noexcept {
        detail::rotation_in_plane(r, angle, 0, 1);
    }
};

/// R = Rz(yaw) Ry(pitch) Rx(roll), rpy = [roll pitch yaw].
struct RotationFromRollPitchYaw {
    static constexpr const char* name = "bf::kernels::RotationFromRollPitchYaw{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class A> void operator()(const R& r, const A& rpy) const noexcept {
        const auto cr = Cos::apply(rpy[0]), sr = Sin::apply(rpy[0]);
        const auto cp = Cos::apply(rpy[1]), sp = Sin::apply(rpy[1]);
        const auto cy = Cos::apply(rpy[2]), sy = Sin::apply(rpy[2]);
        r(0, 0) = cy * cp;
        r(1, 0) = sy * cp;
        r(2, 0) = -sp;
        r(0, 1) = cy * sp * sr - sy * cr;
        r(1, 1) = sy * sp * sr + cy * cr;
        r(2, 1) = cp * sr;
        r(0, 2) = cy * sp * cr + sy * sr;
        r(1, 2) = sy * sp * cr - cy * sr;
        r(2, 2) = cp * cr;
    }
};

/// rpy = [roll pitch yaw] of R = Rz Ry Rx, pitch in [-π/2, π/2]; at ±π/2 roll is 0.
struct RollPitchYawFromRotation {
    static constexpr const char* name = "bf::kernels::RollPitchYawFromRotation{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class A, class R> void operator()(const A& rpy, const R& r) const noexcept {
        using T = Element<A>;
        const T down = r(2, 0), right = pi<T> / 2;
        if (down >= T(1) || down <= T(-1)) {
            rpy[0] = 0;
            rpy[1] = down > T(0) ? -right : right;
            rpy[2] = Atan2::apply<T>(-r(0, 1), r(1, 1));
            return;
        }
        rpy[0] = Atan2::apply<T>(r(2, 1), r(2, 2));
        rpy[1] = Asin::apply<T>(-down);
        rpy[2] = Atan2::apply<T>(r(1, 0), r(0, 0));
    }
};

/// S = skew(x), S v = x × v.
struct Skew {
    static constexpr const char* name = "bf::kernels::Skew{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class X> constexpr void operator()(const S& s, const X& x) const noexcept {
        s(0, 0) = s(1, 1) = s(2, 2) = 0;
        s(2, 1) = x[0];
        s(1, 2) = -x[0];
        s(0, 2) = x[1];
        s(2, 0) = -x[1];
        s(1, 0) = x[2];
        s(0, 1) = -x[2];
    }
};

/// x = vector of the skew part ½ (X - Xᵀ).
struct SkewVee {
    static constexpr const char* name = "bf::kernels::SkewVee{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class V, class X> constexpr void operator()(const V& v, const X& x) const noexcept {
        using T = Element<V>;
        v[0] = T(0.5) * (x(2, 1) - x(1, 2));
        v[1] = T(0.5) * (x(0, 2) - x(2, 0));
        v[2] = T(0.5) * (x(1, 0) - x(0, 1));
    }
};

namespace detail {

/// R = I + f w S + f S², S = skew([x y z]), with f = 2/|q|².
template <class R, class Q, class T>
constexpr void rotation_of_quaternion(const R& r, const Q& q, T f) noexcept {
    const T w = q[0], x = q[1], y = q[2], z = q[3];
    r(0, 0) = T(1) - f * (y * y + z * z);
    r(1, 0) = f * (x * y + w * z);
    r(2, 0) = f * (x * z - w * y);
    r(0, 1) = f * (x * y - w * z);
    r(1, 1) = T(1) - f * (x * x + z * z);
    r(2, 1) = f * (y * z + w * x);
    r(0, 2) = f * (x * z + w * y);
    r(1, 2) = f * (y * z - w * x);
    r(2, 2) = T(1) - f * (x * x + y * y);
}

} // namespace detail

/// R of the quaternion q/|q|. False where |q|² is 0 or not finite.
struct RotationFromQuaternion {
    static constexpr const char* name = "bf::kernels::RotationFromQuaternion{}";
    static constexpr char failure[] =
        "the quaternion is 0 or not finite and stands for no rotation: look at what computes it";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class Q> constexpr bool operator()(const R& r, const Q& q) const noexcept {
        using T = Element<R>;
        const T square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        detail::rotation_of_quaternion(r, q, T(2) / square);
        return square >= std::numeric_limits<T>::min() && square <= std::numeric_limits<T>::max();
    }
};

/// q = [w x y z] of R, of norm 1 with w ≥ 0, from its largest component (Shepperd's method).
struct QuaternionFromRotation {
    static constexpr const char* name = "bf::kernels::QuaternionFromRotation{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Q, class R> constexpr void operator()(const Q& q, const R& r) const noexcept {
        using T = Element<Q>;
        const T trace = r(0, 0) + r(1, 1) + r(2, 2);
        int i = 0;
        if (r(1, 1) > r(i, i)) i = 1;
        if (r(2, 2) > r(i, i)) i = 2;
        if (trace >= r(i, i)) {
            const T root = sqrt(T(1) + trace), scale = T(0.5) / root;
            q[0] = T(0.5) * root;
            q[1] = scale * (r(2, 1) - r(1, 2));
            q[2] = scale * (r(0, 2) - r(2, 0));
            q[3] = scale * (r(1, 0) - r(0, 1));
            return;
        }
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const T root = sqrt(T(1) + r(i, i) - r(j, j) - r(k, k)), twice = r(k, j) - r(j, k);
        const T scale = (twice < T(0) ? T(-0.5) : T(0.5)) / root;
        q[0] = scale * twice;
        q[1 + i] = scale * root * root;
        q[1 + j] = scale * (r(j, i) + r(i, j));
        q[1 + k] = scale * (r(k, i) + r(i, k));
    }
};

/// q̇ = ½ Ω(ω) q + k (1 - qᵀq) q with ω [rad/s] in body axes; k [1/s] pulls the norm to 1.
struct QuaternionDerivative {
    static constexpr const char* name = "bf::kernels::QuaternionDerivative{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class D, class K, class Q, class W>
    constexpr void operator()(const D& derivative, const K& gain, const Q& q, const W& omega) const noexcept {
        using T = Element<D>;
        const T norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        const T pull = gain[0] * (T(1) - norm2), x = omega[0], y = omega[1], z = omega[2];
        derivative[0] = T(0.5) * (-x * q[1] - y * q[2] - z * q[3]) + pull * q[0];
        derivative[1] = T(0.5) * (x * q[0] + z * q[2] - y * q[3]) + pull * q[1];
        derivative[2] = T(0.5) * (y * q[0] - z * q[1] + x * q[3]) + pull * q[2];
        derivative[3] = T(0.5) * (z * q[0] + y * q[1] - x * q[2]) + pull * q[3];
    }
};

/// Rotation vector w = angle · axis with R = exp(skew(w)), |w| ≤ π. With R = R₁ R₂ᵀ it is the rotation error.
struct RotationLog {
    static constexpr const char* name = "bf::kernels::RotationLog{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class W, class R> void operator()(const W& w, const R& r) const noexcept {
        using T = Element<W>;
        T q[4] = {};
        QuaternionFromRotation{}(FixedView<T, 4>{q}, r);
        const T sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        const T scale = sine > T(0) ? T(2) * Atan2::apply<T>(sine, q[0]) / sine : T(2);
        for (int i = 0; i < 3; ++i) w[i] = scale * q[1 + i];
    }
};

/// R = exp(skew(w)), the rotation by |w| about w.
struct RotationExp {
    static constexpr const char* name = "bf::kernels::RotationExp{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class W> void operator()(const R& r, const W& w) const noexcept {
        using T = Element<R>;
        const T angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
        const T scale = angle > T(0) ? Sin::apply<T>(angle / 2) / angle : T(0.5);
        const T q[] = {Cos::apply<T>(angle / 2), scale * w[0], scale * w[1], scale * w[2]};
        detail::rotation_of_quaternion(r, FixedView<const T, 4>{q}, T(2)); // of norm 1 as it is made
    }
};

/// e = vector of the skew part of R₁ R₂ᵀ = sin(angle) · axis of the rotation from R₂ to R₁, in world axes.
struct RotationErrorSkew {
    static constexpr const char* name = "bf::kernels::RotationErrorSkew{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class E, class A, class B>
    constexpr void operator()(const E& e, const A& r1, const B& r2) const noexcept {
        using T = Element<E>;
        T product[9] = {};
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
                product[i + 3 * j] = r1(i, 0) * r2(j, 0) + r1(i, 1) * r2(j, 1) + r1(i, 2) * r2(j, 2);
        SkewVee{}(e, FixedView<const T, 3, 3>{product});
    }
};

/// H = [R p; 0 1].
struct PoseFromRotationPosition {
    static constexpr const char* name = "bf::kernels::PoseFromRotationPosition{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class H, class R, class P>
    constexpr void operator()(const H& h, const R& r, const P& p) const noexcept {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) h(i, j) = r(i, j);
            h(i, 3) = p[i];
            h(3, i) = 0;
        }
        h(3, 3) = 1;
    }
};

/// p of a pose.
struct PosePosition {
    static constexpr const char* name = "bf::kernels::PosePosition{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class P, class H> constexpr void operator()(const P& p, const H& h) const noexcept {
        for (int i = 0; i < 3; ++i) p[i] = h(i, 3);
    }
};

/// R of a pose.
struct PoseRotation {
    static constexpr const char* name = "bf::kernels::PoseRotation{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class R, class H> constexpr void operator()(const R& r, const H& h) const noexcept {
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) r(i, j) = h(i, j);
    }
};

/// y = a b of two poses, a_H_c = a_H_b b_H_c.
struct PoseComposition {
    static constexpr const char* name = "bf::kernels::PoseComposition{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) y(i, j) = a(i, 0) * b(0, j) + a(i, 1) * b(1, j) + a(i, 2) * b(2, j);
            y(i, 3) = a(i, 0) * b(0, 3) + a(i, 1) * b(1, 3) + a(i, 2) * b(2, 3) + a(i, 3);
            y(3, i) = 0;
        }
        y(3, 3) = 1;
    }
};

/// y = h⁻¹ = [Rᵀ, -Rᵀ p; 0 1].
struct PoseInverse {
    static constexpr const char* name = "bf::kernels::PoseInverse{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class H> constexpr void operator()(const Y& y, const H& h) const noexcept {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) y(i, j) = h(j, i);
            y(i, 3) = -(h(0, i) * h(0, 3) + h(1, i) * h(1, 3) + h(2, i) * h(2, 3));
            y(3, i) = 0;
        }
        y(3, 3) = 1;
    }
};

} // namespace bf::kernels
