#pragma once

#include "bf/service/scenery.hpp"

#include <map>

namespace bf::service {

/// A world of one body, whose x is a signal of the run.
class OneBody final : public Scenery {
  public:
    explicit OneBody(std::string signal) : signal_(std::move(signal)) {
        world_.path = "world";
        world_.bodies = {"body"};
        world_.start = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0};
    }
    const SceneWorld& world() const override { return world_; }
    std::string meshes() const override { return "meshes of " + signal_; }
    void bind(const std::vector<Quantity>& signals) override { x_ = find(signals, signal_); }
    void look(std::vector<double>& values) noexcept override {
        values = world_.start;
        values[0] = x_[0];
    }

  private:
    std::string signal_;
    SceneWorld world_;
    Quantity x_;
};

inline Sceneries one_body(const Diagram&, const std::string& signal) {
    Sceneries all;
    all.push_back(std::make_unique<OneBody>(signal));
    return all;
}

} // namespace bf::service
