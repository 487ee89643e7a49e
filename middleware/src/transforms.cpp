#include "bf/middleware/transforms.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace bf::middleware {

OutgoingTransforms::OutgoingTransforms(int count, bool is_static, bool is_model_time)
    : newest(1 + 16 * count), is_static_(is_static), is_model_time_(is_model_time),
      values_(static_cast<std::size_t>(newest.size())), before_(values_.size()),
      all_(static_cast<std::size_t>(count)) {}

void OutgoingTransforms::send() {
    Stamp stamp;
    if (!newest.read(values_.data(), stamp)) return;
    const bool is_first = sent_ == 0;
    sent_ = stamp.number;
    if (is_static_ && !is_first && std::equal(values_.begin() + 1, values_.end(), before_.begin() + 1))
        return;
    before_ = values_;
    const double* from = values_.data() + 1;
    for (auto& each : all_) {
        const Eigen::Map<const Eigen::Matrix4d> H(from);
        each.translation = H.topRightCorner<3, 1>();
        each.rotation = Eigen::Quaterniond(H.topLeftCorner<3, 3>()).normalized().coeffs();
        from += 16;
    }
    publish(is_model_time_ ? values_[0] : clock(), all_);
}

PublishTransformsBlock::PublishTransformsBlock(const Arguments& arguments) : Block(arguments) {
    const auto check = [&](const std::string& frame) {
        if (frame.starts_with('/'))
            problem("the frame '" + frame + "' begins with '/', as frames of tf2 do not; leave it out");
    };
    check(frame_id);
    bool is_fine = !children->empty();
    if (!is_fine) problem("argument 'children' names no frame; name some, such as base");
    for (const auto& child : *children) {
        check(child);
        const bool is_one = std::ranges::count_if(*children, [&](const auto& other) {
                                return plain(other) == plain(child);
                            }) == 1;
        if (!is_one) problem("argument 'children' has the port '" + plain(child) + "' twice");
        if (child.empty() || child == *frame_id)
            problem("the frame '" + child + "' cannot be in '" + *frame_id + "'");
        is_fine = is_fine && is_one;
    }
    if (!is_fine) return;
    for (const auto& child : *children)
        inputs_.emplace_back(this, plain(child),
                             About{.shape = {4, 4}, .doc = "homogeneous: of that frame in frame_id"});
}

void PublishTransformsBlock::start(Now at) const {
    auto end = std::make_shared<OutgoingTransforms>(static_cast<int>(children->size()), is_static,
                                                    *stamp == "model");
    open(at, end);
    at[values].assign(static_cast<std::size_t>(end->newest.size()), 0.0);
    at[opened].end = std::move(end);
}

void PublishTransformsBlock::stop(Now at) const noexcept {
    auto& end = at[opened].end;
    if (end && end->bell != nullptr) send_last(end);
    end.reset();
}

Status PublishTransformsBlock::output(Now at, Out) const noexcept {
    auto& all = at[values];
    OutgoingTransforms& end = *at[opened].end;
    all[0] = at.time();
    double* to = all.data() + 1;
    for (const auto& input : inputs_) to = std::copy_n(at[input].data(), 16, to);
    end.newest.write(all.data(), now());
    if (end.bell != nullptr) end.bell->ring();
    return ok;
}

} // namespace bf::middleware
