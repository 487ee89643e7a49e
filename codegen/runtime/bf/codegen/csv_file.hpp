// The recorded signals of a program as a CSV file.
#pragma once

#include "bf/base/elements.hpp"
#include "bf/base/open_file.hpp"
#include "bf/codegen/number_locale.hpp"
#include "bf/codegen/quantity.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <pthread.h>
#include <string>
#include <thread>
#include <time.h>
#include <vector>

namespace bf::generated {

/// The names of a quantity's elements.
inline std::vector<std::string> names_of_elements(const Quantity& q) {
    return names_of_lines(q.elements, static_cast<std::size_t>(q.size()));
}

/// One row per step and one before each event; numbers read back exactly. The loop copies values into a
/// bounded buffer, and a thread of its own makes text of them and waits for the disk.
class CsvFile {
  public:
    CsvFile() = default;
    CsvFile(const CsvFile&) = delete;
    CsvFile& operator=(const CsvFile&) = delete;
    ~CsvFile() { close(); }

    /// Where the buffer is full, the loop waits, or, if it `may_lose` rows, counts one as lost. Call it
    /// before the loop's thread is prepared for real time, for the file's thread inherits.
    bool open(const std::string& file, Quantities columns, bool may_lose) {
        const int descriptor = open_to_grow(file);
        file_ = descriptor >= 0 ? ::fdopen(descriptor, "w") : nullptr;
        if (!file_) return fail();
        may_lose_ = may_lose;
        columns_ = columns;
        row_bytes_ = sizeof(double);
        std::fputs("time", file_);
        for (const Quantity& q : columns) {
            row_bytes_ += bytes(q);
            const auto names = names_of_elements(q);
            for (int i = 0; i < q.size(); ++i) {
                std::string quoted;
                for (const char c : q.name + element_text(q.rows, q.cols, i, names))
                    quoted += c == '"' ? "\"\"" : c == '\n' ? " " : std::string(1, c);
                std::fprintf(file_, ",\"%s\"", quoted.c_str());
            }
        }
        std::fputc('\n', file_);
        if (std::fflush(file_) != 0) return fail();
        constexpr std::size_t wanted_bytes = std::size_t{4} << 20, least_rows = 64;
        rows_ = std::max(least_rows, wanted_bytes / row_bytes_);
        buffer_.resize(rows_ * row_bytes_);
        sigset_t all, before; // signals are for the thread that steps
        ::sigfillset(&all);
        ::pthread_sigmask(SIG_SETMASK, &all, &before);
        thread_ = std::thread([this] { write_rows(); });
        ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
        return true;
    }

    template <class Model> void row(const Model& model) noexcept {
        const std::uint64_t head = head_.load(std::memory_order_relaxed);
        while (head - tail_.load(std::memory_order_acquire) >= rows_) {
            if (may_lose_) {
                ++lost_;
                return;
            }
            pause();
        }
        std::byte* at = place(head);
        const double time = model.time();
        std::memcpy(at, &time, sizeof time);
        at += sizeof time;
        for (const Quantity& q : columns_) {
            std::memcpy(at, model.data(q), bytes(q));
            at += bytes(q);
        }
        head_.store(head + 1, std::memory_order_release);
    }
    bool is_open() const { return file_ != nullptr; }
    std::uint64_t lost() const { return lost_; }
    /// The errno of the first failure, 0: none. What follows it is not written.
    int error() const noexcept { return error_.load(std::memory_order_relaxed); }
    void close() {
        if (!file_) return;
        ends_.store(true, std::memory_order_release);
        if (thread_.joinable()) thread_.join();
        if (std::fclose(file_) != 0 && !error()) fail();
        file_ = nullptr;
    }

  private:
    static std::size_t bytes(const Quantity& q) noexcept {
        return static_cast<std::size_t>(q.size()) * with_type(q.type, [](auto* t) { return sizeof *t; });
    }
    std::byte* place(std::uint64_t row) noexcept { return buffer_.data() + row % rows_ * row_bytes_; }
    /// Keeps what is in errno. Always false.
    bool fail() noexcept {
        error_.store(errno ? errno : EIO, std::memory_order_relaxed);
        return false;
    }
    static void pause() noexcept {
        const timespec ms{0, 1'000'000};
        ::nanosleep(&ms, nullptr);
    }

    void write_rows() {
        const NumberLocale locale;
        for (std::uint64_t tail = 0;;) {
            const bool ends = ends_.load(std::memory_order_acquire);
            const std::uint64_t head = head_.load(std::memory_order_acquire);
            for (; tail != head; tail_.store(++tail, std::memory_order_release))
                if (!error()) write_row(place(tail));
            // Now, so that a full disk is noticed and a program that is killed leaves its rows.
            if (!error() && std::fflush(file_) != 0) fail();
            if (ends) return;
            pause();
        }
    }
    void write_row(const std::byte* at) {
        double time = 0;
        std::memcpy(&time, at, sizeof time);
        at += sizeof time;
        std::fprintf(file_, "%.17g", time);
        for (const Quantity& q : columns_) {
            with_type(q.type, [&](auto* t) {
                for (int i = 0; i < q.size(); ++i, at += sizeof *t) {
                    std::remove_pointer_t<decltype(t)> value;
                    std::memcpy(&value, at, sizeof value);
                    std::fprintf(file_, ",%.17g", static_cast<double>(value));
                }
            });
        }
        if (std::fputc('\n', file_) == EOF || std::ferror(file_)) fail();
    }

    std::FILE* file_ = nullptr;
    bool may_lose_ = false;
    Quantities columns_{nullptr, 0};
    std::size_t row_bytes_ = 0, rows_ = 0;
    std::vector<std::byte> buffer_; ///< rows: the time, then each column's elements in their own type
    std::uint64_t lost_ = 0;
    // Both only grow; row k lies at place k % rows_.
    std::atomic<std::uint64_t> head_{0}, tail_{0};
    std::atomic<bool> ends_{false};
    std::atomic<int> error_{0};
    std::thread thread_;
};

} // namespace bf::generated
