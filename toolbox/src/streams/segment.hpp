// One stream in a file in memory that the programs of one user share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace bf::toolbox {

/// A file in memory with the newest message of a stream. One opens it as the writer, any number as readers;
/// the kernel forgets them when their programs end, however these end. The last one to close it deletes it.
///
/// It is read and written by calls of the system and not mapped, since who makes a mapped file shorter ends
/// every program that looks at it (SIGBUS). Message k lies in place k mod 4, so that it stays whole while the
/// three after it are written, and the head names the newest one; both carry a check of their words. What
/// does not fit its check, because it is being written or because another program wrote over it, is no
/// message, and the next one puts the file in order.
class Segment {
  public:
    enum class Role { reader, writer };

    /// Creates the file where there is none. Throws std::runtime_error: a name without letters, a second
    /// writer, no memory.
    Segment(const std::filesystem::path& folder, const std::string& name, int size, Role role);
    Segment(const Segment&) = delete;
    Segment& operator=(const Segment&) = delete;
    ~Segment() { close(); }

    /// Is there, in whatever program, one of the other role (or of one's own)?
    bool has(Role role) const noexcept;

    /// The number of the newest message; 0: none can be read.
    std::uint64_t newest() const noexcept { return head().number; }
    /// Number of elements of the newest message that was read.
    int count() const noexcept { return count_; }
    /// False: there is no memory for it any more.
    bool write(const Eigen::Ref<const Eigen::VectorXd>& values, double time) noexcept;
    /// Copies the newest message into `values`, all of which may change; never waits for a writer. Its
    /// number, or `none` where none can be read just now, or `misfit` where it has another number of
    /// elements.
    std::uint64_t read(Eigen::Ref<Eigen::VectorXd> values, double& time) noexcept;
    static constexpr std::uint64_t none = 0, misfit = ~std::uint64_t{0};

  private:
    static constexpr int places = 4;
    struct Head {
        std::uint64_t number, count, check; ///< of the newest message; of its elements
    };
    /// The zeros of a damaged one.
    Head head() const noexcept;
    static std::size_t place_bytes(std::uint64_t count) { return (count + 3) * sizeof(std::uint64_t); }
    void close() noexcept;

    std::filesystem::path file_;
    int descriptor_ = -1, size_, count_ = 0;
    std::uint64_t written_ = 0;        ///< number of the last message that was written here
    std::vector<std::uint64_t> words_; ///< of a message: number, time, values, check
};

} // namespace bf::toolbox
