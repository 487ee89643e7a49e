// Which files a command reads and writes.
#pragma once

#include "session.hpp"

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace bf::tools {

using FileSet = std::set<std::filesystem::path>;

/// All that was read for an elaborated model: its documents, the files that arguments name, robots.
FileSet files_of(const LoadedModel& loaded);

/// The same of one block, without documents.
FileSet files_of(const DiagramNode& node);

/// Is the file one of the robots that are installed with BlockFactory?
bool is_installed_robot(const std::filesystem::path& file);

/// Where a file of the model's goes in what packs it, so that it is found there under the name by which it
/// was found here: model/FILE or share/FILE. Throws CommandError for one from elsewhere: "cannot PURPOSE
/// FILE".
std::filesystem::path packed_place(const std::filesystem::path& file,
                                   const std::filesystem::path& model_folder, const char* purpose);

/// The documents of a model, which are in `texts` or on the disk, and the files that any setting in them
/// names, whether its variant is used or not. Throws model::Errors.
FileSet files_of(const std::filesystem::path& model, std::map<std::filesystem::path, std::string> texts = {});

/// The files in which the blocks of a diagram look for secrets, whether they are there or not.
FileSet secrets_of(const Diagram& diagram);

/// Those files without the secrets of the model's blocks, in unused variants, too: what others may have.
/// Throws model::Errors.
FileSet without_secrets(FileSet files, const LoadedModel& loaded);

/// A folder of this installation, share/blockfactory/NAME, where there is one.
std::filesystem::path shared_folder(const char* name);

/// What this computer's kind is called: x86_64, aarch64.
std::string machine();

/// Is it one by its name?
inline bool is_recording(const std::filesystem::path& file) { return file.extension() == ".mcap"; }

/// A file that a command writes, and the option that names it. An empty name is no file.
struct WrittenFile {
    std::string option;
    std::filesystem::path file;
};
/// Throws CommandError where writing one of them would replace another one, or one that is read.
void refuse_overwriting(const std::vector<WrittenFile>& written, const FileSet& read);

} // namespace bf::tools
