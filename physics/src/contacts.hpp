#pragma once

#include "spec.hpp"

#include <vector>

namespace bf::physics {

/// What one geom exerts on another where they touch (N, Nm, world axes).
struct Touch {
    Eigen::Vector3d force, moment;
};

/// That of the first geom of a contact on its second one. `contact` is a number in d->contact whose forces
/// were solved for.
Touch touch(const mjModel* m, const mjData* d, int contact) noexcept;

/// Are the forces of this contact those between two geoms, and known?
inline bool is_active(const mjContact& contact) {
    return contact.efc_address >= 0 && contact.geom[0] >= 0 && contact.geom[1] >= 0;
}

/// Contacts of the last interval, with the poses of all bodies then. Flat, as it is saved and restored.
class ContactMemory {
  public:
    static constexpr int most = 256; ///< contacts at a time

    /// Begins with no contact.
    explicit ContactMemory(const mjModel* m);

    /// Takes down what MuJoCo has solved for. False: more than `most` contacts.
    bool record(const mjModel* m, const mjData* d) noexcept;

    /// f(other body, position, touch on `body`), with the position in world axes and `other` as MuJoCo
    /// numbers it, for all contacts of a body.
    template <class F> void visit(int body, F&& f) const noexcept {
        for (int i = 0; i < count(); ++i) {
            const double* at = values_.data() + 1 + size * i;
            for (const int side : {0, 1}) {
                if (static_cast<int>(at[side]) != body) continue;
                const Eigen::Map<const Eigen::Vector3d> position(at + 2), force(at + 5), moment(at + 8);
                const double sign = side == 1 ? 1.0 : -1.0;
                f(static_cast<int>(at[1 - side]), Eigen::Vector3d(position),
                  Touch{sign * force, sign * moment});
            }
        }
    }
    /// Pose of a body then.
    Eigen::Matrix4d pose(int body) const noexcept;

    int state_size() const noexcept { return static_cast<int>(values_.size()); }
    const double* data() const noexcept { return values_.data(); }
    double* data() noexcept { return values_.data(); }

  private:
    static constexpr int size = 11; ///< two bodies, position, force, moment
    int count() const noexcept { return static_cast<int>(values_[0]); }

    int poses_;
    std::vector<double> values_;
};

} // namespace bf::physics
