#pragma once

#include <Eigen/Core>

namespace bf::dynamics {

/// Contact-aided invariant extended Kalman filter: orientation R, velocity v and position p of an inertial
/// sensor in the world, the points d_i on which the robot stands, and the biases of gyroscope and
/// accelerometer, from
///
///   R' = R exp((gyroscope - b_g) dt), v' = R (accelerometer - b_a) + g, p' = v, d_i' = 0,   measured: Rᵀ
///   (d_i - p),
///
/// each with white noise. The error is right-invariant, X̂ X⁻¹ = exp(ξ) in SE_{2+k}(3), so that its linear
/// equation hardly depends on the estimate, and with biases exact to the first order. Source: R. Hartley, M.
/// Ghaffari, R. M. Eustice, J. W. Grizzle, Contact-aided invariant extended Kalman filtering for robot state
/// estimation, 2020.
///
/// Errors are in the order [ξ_R ξ_v ξ_p, b_g b_a, ξ_d1 ... ξ_dk] (15 + 3k); rows and columns of contacts that
/// are not there are zero. Yaw and position are not observable: their covariance stays or grows.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class ContactEkf {
  public:
    /// Standard deviations, all isotropic: of a continuous white noise per root of Hz.
    struct Noise {
        double gyroscope = 0.01;          ///< rad/s/√Hz
        double accelerometer = 0.1;       ///< m/s²/√Hz
        double gyroscope_bias = 1e-4;     ///< rad/s²/√Hz, the bias walks
        double accelerometer_bias = 1e-3; ///< m/s³/√Hz
        double contact = 0.05;            ///< m/s/√Hz, a standing point slips
    };

    explicit ContactEkf(int contacts);

    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d v = Eigen::Vector3d::Zero(), p = v;
    Eigen::Vector3d gyroscope_bias = v, accelerometer_bias = v;
    Eigen::Matrix<double, 3, Eigen::Dynamic> d; ///< points of contact in the world
    Eigen::VectorXd is_standing;                ///< (k) 1: there is a contact
    Eigen::MatrixXd P;                          ///< covariance, zeros at first
    Noise noise;
    Eigen::Vector3d gravity{0.0, 0.0, -9.81}; ///< world, m/s²

    static constexpr int before_contacts = 15;

    /// To the time dt later, with gyroscope (rad/s) and accelerometer (specific force, m/s²) in the sensor's
    /// axes.
    void predict(const Eigen::Vector3d& gyroscope, const Eigen::Vector3d& accelerometer, double dt) noexcept;

    /// Takes the position (3) of contact i seen from the sensor, in its axes, with the covariance of that. A
    /// contact that was not there begins there; without `stands` it ends.
    void correct(int i, bool stands, const Eigen::Vector3d& position,
                 const Eigen::Matrix3d& covariance) noexcept;

  private:
    /// X becomes exp(ξ) X, and the biases change by theirs.
    void move(const Eigen::VectorXd& xi) noexcept;

    Eigen::MatrixXd A_, Phi_, product_;
    Eigen::Matrix<double, Eigen::Dynamic, 15> noise_columns_;
    Eigen::Matrix<double, Eigen::Dynamic, 3> cross_, gain_;
    Eigen::VectorXd xi_;
};

} // namespace bf::dynamics
