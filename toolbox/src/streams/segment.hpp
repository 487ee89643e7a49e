// One stream in memory that the programs of one user share.
#pragma once

#include "bf/core/sequence_lock.hpp"

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace bf::toolbox {

/// A file in memory with the newest message of a stream. One opens it as the writer, any number as readers;
/// the kernel forgets them when their programs end, however these end. The last one to close it deletes it.
class Segment {
  public:
    enum class Role { reader, writer };

    /// Creates the file where there is none. Throws std::runtime_error: a name without letters, a second
    /// writer, no memory.
    Segment(const std::filesystem::path& folder, const std::string& name, int size, Role role);
    Segment(const Segment&) = delete;
    Segment& operator=(const Segment&) = delete;
    ~Segment();

    /// Is there, in whatever program, one of the other role (or of one's own)?
    bool has(Role role) const noexcept;

    /// The number of the newest message; 0: none.
    std::uint64_t newest() const noexcept;
    /// Number of elements of the newest message.
    int count() const noexcept;
    void write(const Eigen::Ref<const Eigen::VectorXd>& values, double time) noexcept;
    /// Copies the newest message into `values`, all of which may change; never waits for a writer. Its
    /// number, or `torn` while one is being written, or `misfit` where it has another number of elements.
    std::uint64_t read(Eigen::Ref<Eigen::VectorXd> values, double& time) const noexcept;
    static constexpr std::uint64_t torn = 0, misfit = ~std::uint64_t{0};

  private:
    struct Header {
        SequenceLock lock;
        std::atomic<std::uint64_t> count;
        std::atomic<double> time;
    };
    void close() noexcept;
    std::atomic<double>* values() const noexcept {
        return reinterpret_cast<std::atomic<double>*>(header_ + 1);
    }

    std::filesystem::path file_;
    int descriptor_ = -1;
    std::size_t bytes_ = 0;
    int size_;
    Header* header_ = nullptr;
};

} // namespace bf::toolbox
