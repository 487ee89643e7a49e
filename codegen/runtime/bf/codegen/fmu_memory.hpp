// The memory of an FMU's model: as it is, and as it was when the step under way began.
#pragma once

#include "bf/codegen/fmu_variables.hpp"

#include <cstring>
#include <vector>

namespace bf::generated {

/// Bytes of a whole model: those of its class, then what blocks hold that were made from plugins. Of a step
/// whose signals are repeatable, the latter alone are kept when it begins: all else is computed alike again.
class FmuMemory {
  public:
    void bind(const FmuTables& tables, bf_run_model* model) {
        library_ = tables.library();
        host_ = tables.host;
        is_repeatable_ = tables.are_signals_repeatable;
        model_ = model;
        kept_.resize(host_ ? host_->snapshot_size(model) : library_->snapshot_size);
        own_ = !host_ ? kept_.size() : kept_.empty() ? 0 : host_->own_size(model);
    }
    std::size_t size() const noexcept { return kept_.size(); } ///< 0: some block cannot be saved

    void save(unsigned char* to) const noexcept {
        host_ ? host_->save(model_, to) : library_->save(model_, to);
    }
    void restore(const unsigned char* from) noexcept {
        host_ ? host_->restore(model_, from) : library_->restore(model_, from);
    }

    /// Before the signals of a step are computed.
    void keep() noexcept {
        if (!is_repeatable_)
            save(kept_.data());
        else if (host_)
            host_->save_blocks(model_, kept_.data() + own_);
    }
    /// To where it was when it was kept, but for signals that are computed again.
    void go_back() noexcept {
        if (!is_repeatable_)
            restore(kept_.data());
        else if (host_)
            host_->restore_blocks(model_, kept_.data() + own_);
    }
    /// The memory to which it would go back.
    void save_kept(unsigned char* to) const noexcept {
        if (is_repeatable_) save(to);
        const std::size_t first = is_repeatable_ ? own_ : 0;
        if (kept_.size() > first) std::memcpy(to + first, kept_.data() + first, kept_.size() - first);
    }

  private:
    const bf_run_library* library_ = nullptr;
    const FmuHost* host_ = nullptr;
    bool is_repeatable_ = false;
    bf_run_model* model_ = nullptr;
    std::vector<unsigned char> kept_;
    std::size_t own_ = 0; ///< bytes of the class
};

} // namespace bf::generated
