// Saved states of an FMU, also as bytes.
#pragma once

#include "bf/codegen/fmu_variables.hpp"
#include "bf/fmi/call_order.hpp"
#include "bf/run/run_c.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace bf::generated {

/// Where an instance is in the steps of its model.
struct FmuMoment {
    double time = 0, start = 0, stop = HUGE_VAL; ///< s
    bool is_initialized = false;                 ///< does the model have its initial states?
    bool is_committed = false;                   ///< in model exchange: is it between two steps?
    std::uint64_t active = 0;                    ///< clocks
    std::int64_t ticked = -1;                    ///< the last step of the model at which clocks ticked
};

/// An instance as it was.
struct FmuState {
    const FmuTables* tables; ///< of its model
    fmi::CallOrder order;
    FmuMoment moment;
    std::vector<unsigned char> model;

    /// Bytes: which FMU it is of, how the instance was called, a checksum, then the model.
    std::size_t size() const noexcept { return sizeof(Header) + model.size(); }
    void serialize(unsigned char* to, const char* token) const {
        Header header{fingerprint(*tables, token),
                      model.size(),
                      0,
                      moment.time,
                      moment.start,
                      moment.stop,
                      moment.active,
                      moment.ticked,
                      moment.is_initialized,
                      moment.is_committed,
                      order.state(),
                      order.is_co_simulation()};
        header.checksum = checksum(header, model.data());
        std::memcpy(to, &header, sizeof header);
        std::memcpy(to + sizeof header, model.data(), model.size());
    }
    /// Null for bytes that no instance of this model and kind made, and for damaged ones.
    static std::unique_ptr<FmuState> deserialize(const FmuTables& tables, std::size_t model_size,
                                                 fmi::CallOrder order, const char* token,
                                                 const unsigned char* from, std::size_t count) {
        Header header{};
        if (count == sizeof header + model_size) std::memcpy(&header, from, sizeof header);
        if (header.fingerprint != fingerprint(tables, token) || header.size != model_size ||
            header.is_co_simulation != std::uint32_t(order.is_co_simulation()) ||
            !order.is_state(header.state) || header.checksum != checksum(header, from + sizeof header))
            return nullptr;
        order.set_state(fmi::State(header.state));
        return std::make_unique<FmuState>(
            FmuState{&tables,
                     order,
                     {header.time, header.start, header.stop, header.is_initialized != 0,
                      header.is_committed != 0, header.active, header.ticked},
                     std::vector<unsigned char>(from + sizeof header, from + count)});
    }

  private:
    struct Header {
        std::uint64_t fingerprint, size, checksum;
        double time, start, stop;
        std::uint64_t active;
        std::int64_t ticked;
        std::uint32_t is_initialized, is_committed, state, is_co_simulation;
    };
    /// FNV-1a, behind another one.
    static std::uint64_t hash_of(const void* from, std::size_t count,
                                 std::uint64_t hash = 14695981039346656037u) noexcept {
        for (std::size_t i = 0; i < count; ++i)
            hash = (hash ^ static_cast<const unsigned char*>(from)[i]) * 1099511628211u;
        return hash;
    }
    /// Of the model, and of how it was exported.
    static std::uint64_t fingerprint(const FmuTables& tables, const char* token) noexcept {
        return hash_of(token, std::strlen(token), tables.library()->fingerprint);
    }
    /// Of all but the checksum itself.
    static std::uint64_t checksum(Header header, const unsigned char* model) noexcept {
        header.checksum = 0;
        return hash_of(model, std::size_t(header.size), hash_of(&header, sizeof header));
    }
};

} // namespace bf::generated
