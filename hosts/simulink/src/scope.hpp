// Resources across S-functions: blocks of one model find what encloses them, as in a diagram of our own.
#pragma once

#include "bf/core/registry.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::simulink {

/// The providers among the blocks that are loaded. Simulink gives S-functions nothing in common but their
/// paths, hence one table per process.
class Scope {
  public:
    struct Provider {
        std::string path;
        const BlockClass* type;
        Arguments arguments;
        std::unique_ptr<Block> block;
        /// What runs of the model share, while any block of a run holds it: one per provision.
        std::vector<Object> live;
        std::vector<std::weak_ptr<void>> alive;
    };
    struct Binding {
        std::shared_ptr<Provider> provider; ///< null: nobody around offers it
        std::size_t provision = 0;
    };

    static Scope& instance();

    /// A block that provides something is known from its mdlInitializeSizes to its mdlTerminate.
    void enter(const std::string& path, const BlockClass& type, const Arguments& arguments);
    void leave(const std::string& path);

    /// For each requirement of the block at `path`, the provider in the nearest subsystem around it; those
    /// that are found are bound. Throws what making the description throws.
    std::vector<Binding> bind(const std::string& path, Block& block);
    std::shared_ptr<Provider> find(const std::string& path) const;
    /// The description that the provider offers. Throws.
    std::shared_ptr<const void> description(Provider& provider, std::size_t provision);
    /// The live object behind it, opened by whoever comes first.
    Object open(Provider& provider, std::size_t provision);

  private:
    std::vector<std::shared_ptr<Provider>> providers_;
};

/// The path of the subsystem that holds the block; "" for that of a model. Slashes in names are doubled.
std::string parent(const std::string& path);

} // namespace bf::simulink
