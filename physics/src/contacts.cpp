#include "contacts.hpp"
#include "robot_index.hpp"

#include <algorithm>

namespace bf::physics {

Touch touch(const mjModel* m, const mjData* d, int contact) noexcept {
    // The frame's first row points from the first geom to the second, which is pushed along it.
    mjtNum local[6];
    mj_contactForce(m, d, contact, local);
    const Eigen::Map<const Eigen::Matrix3d> axes(d->contact[contact].frame); // MuJoCo's rows, our columns
    return {axes * Eigen::Map<const Eigen::Vector3d>(local),
            axes * Eigen::Map<const Eigen::Vector3d>(local + 3)};
}

ContactMemory::ContactMemory(const mjModel* m)
    : poses_(1 + size * most), values_(static_cast<size_t>(poses_ + 12 * m->nbody)) {}

bool ContactMemory::record(const mjModel* m, const mjData* d) noexcept {
    int known = 0;
    for (int i = 0; i < d->ncon; ++i) {
        const mjContact& contact = d->contact[i];
        if (!is_active(contact)) continue;
        const Touch on_second = touch(m, d, i);
        if (on_second.force.isZero(0.0)) continue;
        if (known == most) return false;
        double* at = values_.data() + 1 + size * known++;
        for (const int side : {0, 1}) at[side] = m->geom_bodyid[contact.geom[side]];
        std::copy_n(contact.pos, 3, at + 2);
        std::copy_n(on_second.force.data(), 3, at + 5);
        std::copy_n(on_second.moment.data(), 3, at + 8);
    }
    values_[0] = known;
    std::copy_n(d->xpos, 3 * m->nbody, values_.data() + poses_);
    std::copy_n(d->xmat, 9 * m->nbody, values_.data() + poses_ + 3 * m->nbody);
    return true;
}

Eigen::Matrix4d ContactMemory::pose(int body) const noexcept {
    const auto bodies = (static_cast<int>(values_.size()) - poses_) / 12;
    const double* at = values_.data() + poses_;
    return transform(at + 3 * body, at + 3 * bodies + 9 * body);
}

} // namespace bf::physics
