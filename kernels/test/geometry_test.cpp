#include "eigen_views.hpp"

#include "bf/kernels/geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bf::kernels {
namespace {

using Eigen::AngleAxisd, Eigen::Matrix3d, Eigen::Matrix4d, Eigen::Vector3d, Eigen::Vector4d;

Matrix3d rotation(double angle, const Vector3d& axis) {
    return AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}
const Vector3d axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 2, 0.5}, {0.1, 0.2, -3}};
const double angles[] = {0, 1e-9, 0.3, -1.2, 2.5, M_PI - 1e-7, M_PI};

TEST(Rotation, AboutAnAxisAgreesWithEigen) {
    for (double angle : angles) {
        const Eigen::Matrix<double, 1, 1> a(angle);
        Matrix3d x, y, z;
        RotationX{}(view(x), view(a));
        RotationY{}(view(y), view(a));
        RotationZ{}(view(z), view(a));
        EXPECT_LE((x - rotation(angle, axes[0])).norm(), 1e-15);
        EXPECT_LE((y - rotation(angle, axes[1])).norm(), 1e-15);
        EXPECT_LE((z - rotation(angle, axes[2])).norm(), 1e-15);
    }
}

TEST(Rotation, RollPitchYawGoesBothWays) {
    for (double roll : {-3.0, 0.0, 1.1})
        for (double pitch : {-1.5, 0.0, 0.7})
            for (double yaw : {-2.0, 0.0, 3.1}) {
                const Vector3d rpy(roll, pitch, yaw);
                Matrix3d r;
                Vector3d back;
                RotationFromRollPitchYaw{}(view(r), view(rpy));
                RollPitchYawFromRotation{}(view(back), view(r));
                EXPECT_LE(
                    (r - rotation(yaw, axes[2]) * rotation(pitch, axes[1]) * rotation(roll, axes[0])).norm(),
                    1e-15);
                EXPECT_LE((back - rpy).norm(), 1e-13);
            }
}

TEST(Rotation, RollPitchYawIsDefinedAtTheSingularity) {
    for (double sign : {1.0, -1.0}) {
        Matrix3d r = rotation(0.4, axes[2]) * (Matrix3d() << 0, 0, sign, 0, 1, 0, -sign, 0, 0).finished(),
                 again;
        Vector3d rpy;
        RollPitchYawFromRotation{}(view(rpy), view(r));
        RotationFromRollPitchYaw{}(view(again), view(rpy));
        EXPECT_EQ(rpy[0], 0);
        EXPECT_LE((again - r).norm(), 1e-15);
    }
}

TEST(Rotation, QuaternionGoesBothWays) {
    for (const Vector3d& axis : axes)
        for (double angle : angles) {
            const Matrix3d r = rotation(angle, axis);
            Vector4d q;
            Matrix3d back;
            QuaternionFromRotation{}(view(q), view(r));
            RotationFromQuaternion{}(view(back), view(q));
            EXPECT_GE(q[0], 0);
            EXPECT_NEAR(q.norm(), 1, 1e-14);
            EXPECT_LE((back - r).norm(), 1e-14);
        }
}

TEST(Rotation, OfAQuaternionDependsOnItsDirectionAlone) {
    const Matrix3d r = rotation(0.7, axes[3]);
    Vector4d q;
    QuaternionFromRotation{}(view(q), view(r));
    for (const double norm : {1e-100, 0.5, -2.0, 1e100}) {
        const Vector4d scaled = norm * q;
        Matrix3d back;
        EXPECT_TRUE(RotationFromQuaternion{}(view(back), view(scaled)));
        EXPECT_LE((back - r).norm(), 1e-14) << norm;
    }
    for (const double norm : {0.0, double(NAN), HUGE_VAL}) {
        const Vector4d wrong = Vector4d::Constant(norm);
        Matrix3d back;
        EXPECT_FALSE(RotationFromQuaternion{}(view(back), view(wrong))) << norm;
    }
}

TEST(Rotation, ExpAndLogAreInverse) {
    for (const Vector3d& axis : axes)
        for (double angle : angles) {
            const Vector3d w = angle * axis.normalized();
            Matrix3d r;
            Vector3d back;
            RotationExp{}(view(r), view(w));
            RotationLog{}(view(back), view(r));
            EXPECT_LE((r - rotation(angle, axis)).norm(), 1e-14);
            if (std::fabs(angle) < M_PI - 1e-3) {
                EXPECT_LE((back - w).norm(), 1e-14 * (1 + 1 / (M_PI - angle)));
            }
            EXPECT_NEAR(back.norm(), std::fabs(angle), 1e-13);
        }
}

TEST(Rotation, SkewErrorIsTheSineOfTheAngle) {
    const Vector3d axis = axes[3].normalized();
    const Matrix3d r2 = rotation(0.7, axes[4]), r1 = rotation(0.3, axis) * r2;
    Vector3d e;
    RotationErrorSkew{}(view(e), view(r1), view(r2));
    EXPECT_LE((e - std::sin(0.3) * axis).norm(), 1e-15);
}

TEST(Rotation, SkewIsTheCrossProduct) {
    const Vector3d x(1, 2, 3), v(-4, 5, 0.5);
    Matrix3d s;
    Vector3d back;
    Skew{}(view(s), view(x));
    SkewVee{}(view(back), view(s));
    EXPECT_EQ(s * v, x.cross(v));
    EXPECT_EQ(back, x);
}

TEST(Rotation, QuaternionDerivativeTurnsTheBody) {
    const double h = 1e-6;
    const Vector3d omega(0.3, -0.5, 0.8), turned = h * omega;
    const Matrix3d r = rotation(0.9, axes[3]);
    Matrix3d step, later;
    Vector4d q, derivative, next;
    const Eigen::Matrix<double, 1, 1> pull(2);
    QuaternionFromRotation{}(view(q), view(r));
    QuaternionDerivative{}(view(derivative), view(pull), view(q), view(omega));
    RotationExp{}(view(step), view(turned));
    later = r * step;
    QuaternionFromRotation{}(view(next), view(later));
    EXPECT_LE(((next - q) / h - derivative).norm(), 1e-6);
    const Vector4d longer = 1.1 * q;
    QuaternionDerivative{}(view(derivative), view(pull), view(longer), view(omega));
    EXPECT_NEAR(longer.dot(derivative), 2 * (1 - 1.21) * 1.21, 1e-14);
}

TEST(Pose, InverseAndCompositionAgreeWithMatrices) {
    Matrix4d a = Matrix4d::Identity(), b = a, y;
    const Matrix3d r = rotation(0.8, axes[3]);
    const Vector3d p(1, -2, 0.3);
    PoseFromRotationPosition{}(view(a), view(r), view(p));
    b.topLeftCorner<3, 3>() = rotation(-2, axes[4]);
    b.topRightCorner<3, 1>() = Vector3d(4, 5, 6);
    EXPECT_EQ((a.topLeftCorner<3, 3>()), r);
    EXPECT_EQ((a.topRightCorner<3, 1>()), p);
    EXPECT_EQ(a.row(3), Eigen::RowVector4d(0, 0, 0, 1));
    PoseComposition{}(view(y), view(a), view(b));
    EXPECT_LE((y - a * b).norm(), 1e-14);
    PoseInverse{}(view(y), view(a));
    EXPECT_LE((y * a - Matrix4d::Identity()).norm(), 1e-14);
    Matrix3d r2;
    Vector3d p2;
    PoseRotation{}(view(r2), view(a));
    PosePosition{}(view(p2), view(a));
    EXPECT_EQ(r2, r);
    EXPECT_EQ(p2, p);
}

} // namespace
} // namespace bf::kernels
