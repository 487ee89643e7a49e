// A robot on a bench, to try gains of its position loops.
#pragma once

#include "bf/physics/scene.hpp"
#include "bf/physics/world.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::tuning {

/// A robot alone in its world, without floor, objects, noise and imperfections, whose base stands still where
/// it starts, and the loops behind ControlMode::position_direct. Vectors have an element for each joint.
class Bench {
  public:
    Bench() = default;
    virtual ~Bench() = default;
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

    virtual const std::vector<std::string>& joints() const = 0;
    virtual const Eigen::VectorXd& effort_limits() const = 0;
    virtual const Eigen::VectorXd& lower_limits() const = 0;
    virtual const Eigen::VectorXd& upper_limits() const = 0;
    virtual const physics::Gains& given() const = 0; ///< those that the world has
    virtual const physics::Gains& safe() const = 0;  ///< critical damping of 30 rad/s, see MotorOptions
    virtual double period() const = 0;               ///< s, of a step of the physics
    virtual double loop_period() const = 0;          ///< s, of the loops
    virtual bool is_held() const = 0;                ///< does the base float outside of the bench?

    /// At rest in the start pose s_0, which the loops hold by the torques `holding`: those without I by
    /// references s_0 + holding / P, those with I by their integrals.
    void begin(const physics::Gains& gains, const Eigen::VectorXd& holding);
    const Eigen::VectorXd& references() const { return references_; }
    void command(const Eigen::VectorXd& references);
    /// Throws std::runtime_error when the motion diverges.
    void step();

    virtual Eigen::Map<const Eigen::VectorXd> s() const = 0;      ///< rad, now
    virtual Eigen::Map<const Eigen::VectorXd> s_dot() const = 0;  ///< rad/s, now
    virtual Eigen::Map<const Eigen::VectorXd> s_ddot() const = 0; ///< rad/s2, last interval
    virtual Eigen::Map<const Eigen::VectorXd> tau() const = 0;    ///< Nm after the limits, last interval

  private:
    virtual void reset() = 0;
    virtual physics::JointControl& control() = 0;
    virtual bool advance() = 0;
    virtual const char* error() const = 0;

    Eigen::VectorXd references_;
};

/// The robot of a world that steps, as its loops do, once per `period` (s). Start positions are those
/// of the world, or `pose` where that is not empty. Throws std::runtime_error for a pose of another size, or
/// where the base link moves with the joints.
std::unique_ptr<Bench> bench_of(const physics::World& world, double period,
                                const std::vector<double>& pose = {});
/// A robot of a scene, by its number. A base that floats by a free joint of an MJCF is held as one of a URDF
/// is.
std::unique_ptr<Bench> bench_of(const physics::Scene& scene, int robot, const std::vector<double>& pose = {});

} // namespace bf::tuning
