#include "bf/recording/export.hpp"

#include <array>
#include <cctype>
#include <cstring>
#include <matio.h>
#include <memory>
#include <set>
#include <stdexcept>

namespace bf::recording {
namespace {

struct Free {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
    void operator()(mat_t* file) const { Mat_Close(file); }
};
using Variable = std::unique_ptr<matvar_t, Free>;

struct Class {
    matio_classes kind;
    matio_types storage;
};

Class class_of(ElementType type) {
    switch (type) {
    case ElementType::Double: return {MAT_C_DOUBLE, MAT_T_DOUBLE};
    case ElementType::Single: return {MAT_C_SINGLE, MAT_T_SINGLE};
    case ElementType::Int8: return {MAT_C_INT8, MAT_T_INT8};
    case ElementType::Uint8: return {MAT_C_UINT8, MAT_T_UINT8};
    case ElementType::Int16: return {MAT_C_INT16, MAT_T_INT16};
    case ElementType::Uint16: return {MAT_C_UINT16, MAT_T_UINT16};
    case ElementType::Int32: return {MAT_C_INT32, MAT_T_INT32};
    case ElementType::Uint32: return {MAT_C_UINT32, MAT_T_UINT32};
    case ElementType::Boolean: return {MAT_C_UINT8, MAT_T_UINT8}; // and the flag "logical"
    }
    return {MAT_C_DOUBLE, MAT_T_DOUBLE};
}

/// The variable copies what it is given.
template <std::size_t rank>
Variable array(Class type, std::array<std::size_t, rank> size, const void* data, int flags = 0) {
    Variable variable(
        Mat_VarCreate(nullptr, type.kind, type.storage, rank, size.data(), const_cast<void*>(data), flags));
    if (!variable) throw std::bad_alloc();
    return variable;
}

Variable numbers(std::size_t rows, std::size_t cols, const std::vector<double>& values) {
    return array<2>({MAT_C_DOUBLE, MAT_T_DOUBLE}, {rows, cols}, values.data());
}

Variable text(const std::string& text) {
    return array<2>({MAT_C_CHAR, MAT_T_UTF8}, {1, text.size()}, text.data());
}

Variable texts(const std::vector<std::string>& list) {
    std::vector<matvar_t*> cells;
    for (const auto& each : list) cells.push_back(text(each).release());
    const std::array<std::size_t, 2> size = {list.size(), 1};
    Variable variable(Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, const_cast<std::size_t*>(size.data()),
                                    cells.data(), 0));
    if (!variable) throw std::bad_alloc();
    return variable;
}

Variable structure(const char* name, std::vector<const char*> fields, std::vector<Variable> values) {
    fields.push_back(nullptr);
    const std::array<std::size_t, 2> one = {1, 1};
    Variable variable(Mat_VarCreateStruct2(name, 2, one.data(), fields.data()));
    if (!variable) throw std::bad_alloc();
    for (std::size_t i = 0; i < values.size(); ++i)
        Mat_VarSetStructFieldByIndex(variable.get(), i, 0, values[i].release());
    return variable;
}

/// Sample after sample becomes rows x cols x N as it is; a table of N x n needs its transpose.
Variable values_of(const Channel& channel) {
    const std::size_t n = channel.info.elements(), samples = channel.samples(),
                      size = size_of(channel.info.type);
    const int flags = channel.info.type == ElementType::Boolean ? MAT_F_LOGICAL : 0;
    const Class type = class_of(channel.info.type);
    if (channel.info.is_matrix)
        return array<3>(type, {channel.info.rows, channel.info.cols, samples}, channel.data.data(), flags);
    std::vector<std::byte> table(channel.data.size());
    for (std::size_t k = 0; k < samples; ++k)
        for (std::size_t i = 0; i < n; ++i)
            std::memcpy(&table[(i * samples + k) * size], &channel.data[(k * n + i) * size], size);
    return array<2>(type, {samples, n}, table.data(), flags);
}

std::vector<double> dimensions(const ChannelInfo& info) {
    if (info.is_matrix) return {double(info.rows), double(info.cols)};
    return {double(info.rows)};
}

/// A valid MATLAB name: letters, digits and underscores, a letter first, at most 63.
std::string identifier(const std::string& name, std::set<std::string>& taken) {
    std::string base;
    for (const char c : name) base += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
    if (!std::isalpha(static_cast<unsigned char>(base[0]))) base.insert(0, "x");
    std::string result = base.substr(0, 63);
    for (int i = 2; !taken.insert(result).second; ++i) {
        const std::string suffix = "_" + std::to_string(i);
        result = base.substr(0, 63 - suffix.size()) + suffix;
    }
    return result;
}

/// A MAT-file that is written variable by variable.
class MatFile {
  public:
    explicit MatFile(const std::filesystem::path& path)
        : path_(path),
          file_(Mat_CreateVer(path.c_str(), "MATLAB 5.0 MAT-file, written by BlockFactory", MAT_FT_MAT5)) {
        if (!file_) fail("the file cannot be created; check that the folder exists and may be written");
    }
    void write(const Variable& variable) {
        written_ = written_ && Mat_VarWrite(file_.get(), variable.get(), MAT_COMPRESSION_NONE) == 0;
    }
    /// matio does not notice every failed write, hence the look at the size: at least so many bytes.
    void close(std::uintmax_t bytes) {
        written_ = Mat_Close(file_.release()) == 0 && written_;
        std::error_code none;
        const bool is_file = std::filesystem::is_regular_file(path_, none);
        if (!written_ || !is_file || std::filesystem::file_size(path_, none) < bytes)
            fail("the disk is full or gone; free space, or choose another disk");
    }
    [[noreturn]] void fail(const std::string& why) const { refuse(path_, why); }
    [[noreturn]] static void refuse(const std::filesystem::path& path, const std::string& why) {
        throw std::runtime_error("cannot write '" + path.string() + "': " + why);
    }

  private:
    std::filesystem::path path_;
    std::unique_ptr<mat_t, Free> file_;
    bool written_ = true;
};

} // namespace

void write_mat(const Recording& recording, const std::filesystem::path& path) {
    std::uintmax_t bytes = 0;
    for (const Channel& channel : recording.channels) {
        // MAT-files of version 5 hold variables of up to 2 GB.
        const std::size_t size = channel.data.size() + 8 * channel.samples();
        if (size > 0x7FFF0000)
            MatFile::refuse(
                path,
                "the signal '" + channel.name + "' has " + std::to_string(size >> 20) +
                    " MB and a MAT-file holds 2047 MB per variable; export to CSV or record at a lower rate");
        bytes += size;
    }
    MatFile file(path);
    std::set<std::string> taken;
    for (const Channel& channel : recording.channels) {
        const std::vector<double> size = dimensions(channel.info);
        std::vector<Variable> signals, fields;
        signals.push_back(values_of(channel));
        signals.push_back(numbers(1, size.size(), size));
        signals.push_back(text(channel.name));
        signals.push_back(text(channel.info.unit));
        fields.push_back(numbers(channel.samples(), 1, channel.times()));
        std::vector<const char*> members{"values", "dimensions", "label", "unit"};
        if (!channel.info.element_names.empty()) {
            members.push_back("elements");
            signals.push_back(texts(channel.info.element_names));
        }
        fields.push_back(structure("signals", std::move(members), std::move(signals)));
        const Variable variable =
            structure(identifier(channel.name, taken).c_str(), {"time", "signals"}, std::move(fields));
        file.write(variable);
    }
    file.close(bytes);
}

void write_mat(const std::vector<MatVariable>& variables, const std::filesystem::path& path) {
    MatFile file(path);
    std::uintmax_t bytes = 0;
    for (const auto& [name, rows, cols, values, cells] : variables) {
        Variable variable = cells.empty() ? numbers(rows, cols, values) : texts(cells);
        variable->name = ::strdup(name.c_str()); // which its owner frees
        file.write(variable);
        bytes += values.size() * sizeof(double);
    }
    file.close(bytes);
}

} // namespace bf::recording
