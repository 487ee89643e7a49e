// Every block of a native plugin, offered to engines that know only the paper's API.
#pragma once

#include "BlockFactory/Core/Block.h"
#include "bf/boundary/positional.hpp"
#include "bf/core/registry.hpp"
#include "sharedlibpp/SharedLibraryClassApi.h"

#include <memory>
#include <string>
#include <vector>

namespace bf::boundary {

/// A native block behind the six methods.
///
/// Parameters are those of positional.hpp, the providers being blocks without ports of the same plugin (a
/// robot's description); this API tells blocks neither time nor period, hence `sample_time`. Numbers are
/// DOUBLE, true and false BOOL, texts STRING, lists of texts CELL_STRING; what takes one
/// number only is a scalar, all else a vector of open length. Matrices are given as vectors, column by
/// column, with as many columns as the default.
///
/// Inputs that may stay unconnected are left out, since old engines connect every port. `output` computes
/// outputs and the next state. Blocks with continuous states, and those that need a live robot, are refused
/// by initialize with the reason in the Log.
class AsLegacyBlock final : public blockfactory::core::Block {
  public:
    AsLegacyBlock(std::shared_ptr<const Library> library, std::string name);
    ~AsLegacyBlock() override;

    unsigned numberOfParameters() override;
    bool parseParameters(blockfactory::core::BlockInformation* blockInfo) override;
    bool configureSizeAndPorts(blockfactory::core::BlockInformation* blockInfo) override;
    bool initialize(blockfactory::core::BlockInformation* blockInfo) override;
    bool initializeInitialConditions(const blockfactory::core::BlockInformation* blockInfo) override;
    bool output(const blockfactory::core::BlockInformation* blockInfo) override;
    bool terminate(const blockfactory::core::BlockInformation* blockInfo) override;

  private:
    struct Running;
    const BlockClass& find(const std::string& name) const;
    std::vector<const BlockClass*> classes() const; ///< the block's own, then its providers'
    std::vector<PositionalValue> parameters() const;
    std::unique_ptr<Running> make() const;
    template <class F> bool guarded(const char* call, F&& f) noexcept;

    std::shared_ptr<const Library> library_;
    std::string name_;
    std::unique_ptr<Running> running_;
};

/// What the exported factory functions call. `inside` is any address in the plugin: its own bf_plugin_v1 is
/// found from there, whatever else of that name the program has loaded. Null, and an error in the Log, when
/// there is none.
blockfactory::core::Block* make_legacy_block(const void* inside, const char* name);

} // namespace bf::boundary

namespace {
const char bf_inside_this_plugin = 0;
}

#define BF_LEGACY_BLOCK(label)                                                                               \
    SHLIBPP_DEFINE_HOOK(                                                                                     \
        SHLIBPP_DEFAULT_START_CHECK, SHLIBPP_DEFAULT_END_CHECK, SHLIBPP_DEFAULT_SYSTEM_VERSION, label,       \
        bf::boundary::make_legacy_block(&bf_inside_this_plugin, #label),                                     \
        delete static_cast<blockfactory::core::Block*>(object), #label, "blockfactory::core::Block")

/// Beside bf_plugin_v1, at global scope: exports the named blocks through the old factory symbols too.
///   BF_LEGACY_BLOCKS(MassMatrix, Jacobian)
#define BF_LEGACY_BLOCKS(...) __VA_OPT__(BF_EXPAND_(BF_EACH_(__VA_ARGS__)))
#define BF_EACH_(first, ...) BF_LEGACY_BLOCK(first) __VA_OPT__(BF_AGAIN_ BF_PARENS_(__VA_ARGS__))
#define BF_AGAIN_() BF_EACH_
#define BF_PARENS_ ()
// Each level scans four times, so that lists may have 256 names.
#define BF_EXPAND_(...) BF_EXPAND4_(BF_EXPAND4_(BF_EXPAND4_(BF_EXPAND4_(__VA_ARGS__))))
#define BF_EXPAND4_(...) BF_EXPAND3_(BF_EXPAND3_(BF_EXPAND3_(BF_EXPAND3_(__VA_ARGS__))))
#define BF_EXPAND3_(...) BF_EXPAND2_(BF_EXPAND2_(BF_EXPAND2_(BF_EXPAND2_(__VA_ARGS__))))
#define BF_EXPAND2_(...) BF_EXPAND1_(BF_EXPAND1_(BF_EXPAND1_(BF_EXPAND1_(__VA_ARGS__))))
#define BF_EXPAND1_(...) __VA_ARGS__
