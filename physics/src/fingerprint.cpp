// A number that tells scenes apart whose states are of one size.
#include "scene_impl.hpp"

#include <cstdint>
#include <mujoco/mjxmacro.h>
#include <string_view>

namespace bf::physics {

namespace {

/// FNV-1a, 64 bits (Fowler, Noll, Vo).
class Hash {
  public:
    void add(const void* data, size_t size) {
        for (size_t i = 0; i < size; ++i)
            hash_ = (hash_ ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3;
    }
    void add(double value) { add(&value, sizeof value); }
    void add(const Eigen::VectorXd& values) {
        add(values.data(), sizeof(double) * static_cast<size_t>(values.size()));
    }
    /// A double has no more bits for whole numbers.
    double value() const { return static_cast<double>(hash_ >> 11); }

  private:
    std::uint64_t hash_ = 0xcbf29ce484222325;
};

void add_model(Hash& hash, const mjModel* m) {
    for (const double value :
         {m->opt.timestep, m->opt.impratio, m->opt.gravity[0], m->opt.gravity[1], m->opt.gravity[2],
          static_cast<double>(m->opt.integrator), static_cast<double>(m->opt.cone),
          static_cast<double>(m->opt.disableflags), static_cast<double>(m->opt.enableflags)})
        hash.add(value);
    MJMODEL_POINTERS_PREAMBLE(m)
#define X(type, field, rows, columns)                                                                        \
    if (std::string_view(#field) != "paths") /* meshes may move to another folder */                         \
        hash.add(m->field, sizeof(type) * static_cast<size_t>(m->rows) * static_cast<size_t>(columns));
    MJMODEL_POINTERS
#undef X
}

} // namespace

void Scene::Impl::make_fingerprint() {
    Hash hash;
    add_model(hash, model.get());
    for (size_t r = 0; r < robots.size(); ++r) {
        const RobotOptions& own = options.robots[r].options;
        for (const double value :
             {own.noise.position, own.noise.velocity, own.noise.torque, static_cast<double>(own.noise.seed),
              own.imperfections.dropout, own.imperfections.velocities_from_encoders ? 1.0 : 0.0,
              static_cast<double>(robots[r].loop_steps)})
            hash.add(value);
        hash.add(robots[r].encoder_resolution);
        hash.add(robots[r].motor_encoder_resolution);
        const Motors& motors = *robots[r].drives;
        for (const Eigen::VectorXd* values :
             {&motors.gear_ratio, &motors.torque_constant, &motors.parameters.k_tau,
              &motors.parameters.k_bemf, &motors.stiffness, &motors.damping})
            hash.add(*values);
    }
    fingerprint = hash.value();
}

} // namespace bf::physics
