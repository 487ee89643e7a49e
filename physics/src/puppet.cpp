#include "puppet.hpp"
#include "scene_impl.hpp"

#include <algorithm>
#include <stdexcept>

namespace bf::physics {

Puppet::Puppet(const World& world, const std::function<void(mjSpec*)>& decorate) {
    WorldOptions drawn = world.options();
    drawn.floating_base = drawn.lands = false;
    const Urdf urdf = Urdf::read(drawn.urdf);
    const SpecPtr spec = make_spec(drawn, drawn, urdf, Looks::meshes);
    mjsBody* ground = mjs_findBody(spec.get(), "world");
    for (mjsElement* body = mjs_firstChild(ground, mjOBJ_BODY, 0); body;
         body = mjs_nextChild(ground, body, 0))
        mjs_asBody(body)->mocap = 1;
    for (const SceneObject& object : drawn.terrain) add_object(spec.get(), object);
    if (decorate) decorate(spec.get());
    model_ = compile(spec.get(), urdf.file);
    data_ = make_data(model_.get());
    base_site_ = id_of(model_.get(), mjOBJ_SITE, mark("base"));
    for (const std::string& name : world.joint_names())
        position_.push_back(model_->jnt_qposadr[id_of(model_.get(), mjOBJ_JOINT, name)]);
    followers_ = follower_addresses(model_.get(), drawn);
    roots_.resize(static_cast<size_t>(model_->nmocap));
    for (int body = 1; body < model_->nbody; ++body) {
        if (model_->body_mocapid[body] < 0) continue;
        mjtNum rotation[9];
        mju_quat2Mat(rotation, model_->body_quat + 4 * body);
        roots_[static_cast<size_t>(model_->body_mocapid[body])] =
            transform(model_->body_pos + 3 * body, rotation);
    }
}

Puppet::Puppet(const Scene& scene, const std::function<void(mjSpec*)>& decorate) {
    SceneOptions drawn = scene.options();
    std::vector<RobotStart> starts;
    std::vector<std::string> warnings;
    const SpecPtr spec = make_scene(drawn, Looks::meshes, starts, warnings);
    if (decorate) decorate(spec.get());
    model_ = compile(spec.get(), "the world");
    const mjModel* moves = scene.impl_->model.get();
    if (model_->nq != moves->nq || model_->nbody != moves->nbody)
        throw std::logic_error("the world and its looks have other joints");
    std::copy_n(moves->body_pos, 3 * moves->nbody, model_->body_pos);
    std::copy_n(moves->body_quat, 4 * moves->nbody, model_->body_quat);
    data_ = make_data(model_.get());
}

void Puppet::place(std::span<const double> q) {
    std::copy(q.begin(), q.end(), data_->qpos);
    compute();
}

void Puppet::compute() {
    mj_kinematics(model_.get(), data_.get());
    mj_comPos(model_.get(), data_.get());
}

void Puppet::place(const Eigen::Matrix4d& w_H_b, std::span<const double> s) {
    for (size_t i = 0; i < s.size(); ++i) data_->qpos[position_[i]] = s[i];
    for (const FollowerAddress& follower : followers_) follower.put(data_->qpos);
    place_root(Eigen::Matrix4d::Identity());
    const Eigen::Matrix4d root_H_base =
        transform(data_->site_xpos + 3 * base_site_, data_->site_xmat + 9 * base_site_);
    place_root(w_H_b * inverse(root_H_base));
}

void Puppet::place_root(const Eigen::Matrix4d& w_H_root) {
    for (size_t i = 0; i < roots_.size(); ++i) {
        const Eigen::Matrix4d H = w_H_root * roots_[i];
        const Eigen::Quaterniond q(Eigen::Matrix3d(H.topLeftCorner<3, 3>()));
        const double rotation[4] = {q.w(), q.x(), q.y(), q.z()};
        std::copy_n(H.col(3).data(), 3, data_->mocap_pos + 3 * i);
        std::copy_n(rotation, 4, data_->mocap_quat + 4 * i);
    }
    compute();
}

} // namespace bf::physics
