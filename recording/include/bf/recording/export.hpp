#pragma once

#include "bf/recording/reader.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace bf::recording {

/// The files that `write_csv` writes: `path`, or one per signal, "run.csv" becoming "run_controller.tau.csv".
std::vector<std::filesystem::path> csv_files(const Recording& recording, const std::filesystem::path& path);

/// Writes a table: a line of names with units, "time (s),tau[1] (N m),...", then one line per sample; numbers
/// are exact. Signals sampled at the same times share the one file `path`; otherwise each signal gets a file
/// of its own. Returns the files written; all appear, or none.
/// Throws FileError when one cannot be written.
std::vector<std::filesystem::path> write_csv(const Recording& recording, const std::filesystem::path& path);

/// Writes a MAT-file (version 5), one "Structure With Time" per signal, as To Workspace makes it: `time` (N x
/// 1), `signals.values` (N x n for a scalar or 1-D signal, rows x cols x N for a matrix, of the signal's own
/// class), `signals.dimensions`, `signals.label`, `signals.unit`, and `signals.elements`, a cell array, where
/// the elements have names. "controller.tau" becomes the variable controller_tau. Throws std::runtime_error
/// when it cannot be written.
void write_mat(const Recording& recording, const std::filesystem::path& path);

/// A matrix, column by column, or a cell array of texts.
struct MatVariable {
    std::string name; ///< as MATLAB takes it
    std::size_t rows = 0, cols = 0;
    std::vector<double> values;
    std::vector<std::string> texts = {};
};
/// Writes them to a MAT-file (version 5). Throws std::runtime_error when it cannot be written.
void write_mat(const std::vector<MatVariable>& variables, const std::filesystem::path& path);

/// Where two recordings part.
struct Difference {
    std::string channel;
    double time = 0; ///< seconds; 0 when the declarations differ
    std::string text;
};

/// The earliest difference in the signals, bit for bit (so 0 and -0 differ, and a NaN equals itself); empty
/// when there is none. Metadata and attachments are not compared. Ties are broken by the order in `a`.
std::optional<Difference> first_difference(const Recording& a, const Recording& b);

} // namespace bf::recording
