// What of a run stands in space: told by whoever knows its physics, so that the service needs none.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/run/run.hpp"
#include "bf/service/scene.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::service {

/// A world of a model with what moves in it.
class Scenery {
  public:
    Scenery() = default;
    virtual ~Scenery() = default;
    Scenery(const Scenery&) = delete;
    Scenery& operator=(const Scenery&) = delete;

    virtual const SceneWorld& world() const = 0;
    /// All meshes, in the protocol's form.
    virtual std::string meshes() const = 0;

    /// From now on these signals tell where things are. Called, as `look`, in the thread of the run.
    virtual void bind(const std::vector<Quantity>& signals) = 0;
    /// Appends the values of a binary frame.
    virtual void look(std::vector<double>& values) noexcept = 0;
};

/// One for each world, in the order of the diagram.
using Sceneries = std::vector<std::unique_ptr<Scenery>>;
/// Throws std::exception where a mesh cannot be had.
using MakeSceneries = std::function<Sceneries(const Diagram&)>;

} // namespace bf::service
