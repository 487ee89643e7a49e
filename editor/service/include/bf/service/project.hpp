// The opened model with the files it refers to: edits, undo, and files that are always as the page shows
// them.
#pragma once

#include "bf/model/operation.hpp"
#include "bf/service/moves.hpp"
#include "bf/service/worker.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace bf::service {

class Disk;

/// One document for each file. What is edited lands in its file at once, and what another program writes into
/// a file is taken over, as an edit that can be undone. Edits that were on their way to the file meanwhile
/// are made again on what that program wrote.
class Project {
  public:
    using Texts = std::optional<std::map<std::filesystem::path, std::string>>;

    /// Reads the model and all it refers to. A worker writes files beside it, and calls `written` after each;
    /// without one they are written at once. What programs that were killed left in the folders goes. With
    /// `texts` the model is in these, which stand for files: none is read or written. Throws model::Errors,
    /// FileError.
    explicit Project(const std::filesystem::path& file, Worker* disk = nullptr,
                     std::function<void()> written = {}, Texts texts = {});
    ~Project(); ///< waits until all is written

    const std::filesystem::path& file() const;
    /// With the content of all files it refers to.
    const model::Model& model() const;
    /// Counts changes of any of the files.
    std::int64_t revision() const { return revision_; }

    /// Which blocks are the same ones as before, under other paths of the whole model.
    const Moves& moves() const { return moves_; }

    /// Paths are those of the whole model: what lies under a block that stands for another file is an edit of
    /// that file. A name that is changed there is followed by all files of the folder that refer to that one,
    /// and one undo takes all of that back. Throws model::Errors and changes nothing where it is impossible.
    void edit(const model::Operation& operation);
    bool undo() { return step(done_, undone_, &model::History::undo); }
    bool redo() { return step(undone_, done_, &model::History::redo); }
    bool can_undo() const { return !done_.empty(); }
    bool can_redo() const { return !undone_.empty(); }

    /// Another text for one of the files, as an edit that can be undone. False where the file does not hold
    /// `before`: another page or program was faster. Throws model::Errors with what is wrong in the text, or
    /// in files that refer to this one, and changes nothing.
    bool rewrite(const std::filesystem::path& file, const std::string& before, const std::string& text);
    /// What the file holds: the text of its model, or one that is no model and that another program wrote.
    std::string text_in(const std::filesystem::path& file) const;
    /// The model again, with the places of all items in the texts, and without comments.
    std::shared_ptr<const model::Model> as_read() const;
    /// Of all models, by their files.
    std::map<std::filesystem::path, std::string> texts() const;

    /// Writes what could not be written before, and reads what others wrote; true when that changed the model
    /// or `failure`.
    bool synchronise();
    /// Takes note of what was written; true when another program was faster, so that `synchronise` has to
    /// look.
    bool note_written();
    /// Are all files on the disk as the models?
    bool is_saved() const;
    /// Tries until the disk has answered. Which files are not as the models, and why; empty when all are.
    std::string unsaved();
    /// Why a file is not as the model, with the remedy; empty when all are, or will be.
    std::string failure() const;
    /// Which edit does not fit what another program wrote at the same time, with the remedy; until the next
    /// edit.
    const std::string& collision() const { return collision_; }

    /// The file in which the block or subsystem of that path stands, and its path there.
    std::pair<std::filesystem::path, std::string> place_of(const std::string& path) const;

  private:
    struct Document;
    Document* find(const std::filesystem::path& file) const;
    Document& open(const std::filesystem::path& file);
    Document& document_of(std::string& path) const;
    static void require_own(const Document& document);
    void require_inside(const std::filesystem::path& file) const;
    std::vector<model::Diagnostic> mistakes_beside(const Document& document,
                                                   const std::set<std::string>& known = {}) const;
    /// The files that one edit changed, and the one that it made, which goes when the edit is undone.
    struct Step {
        std::vector<Document*> changed;
        Document* made = nullptr;
    };
    void open_referring(const std::filesystem::path& file);
    std::vector<std::pair<Document*, model::Model>> followed(const Document& document,
                                                             const model::operations::Rename& rename);
    std::vector<std::pair<Document*, model::Model>> followed(const Document& document,
                                                             const model::operations::RenameVariable& rename);
    void link(Document& document);
    std::shared_ptr<const model::Model> shared(Document& document);
    void link_all();
    model::Operation localised(model::Operation operation, Document*& document) const;
    void apply(Document& document, const model::Operation& operation);
    void repeat(Document& document, const std::vector<std::optional<model::Operation>>& edits);
    bool look(Document& document);
    void take(Document& document, model::Model model, const std::string& text);
    bool step(std::vector<Step>& from, std::vector<Step>& to, bool (model::History::*move)(model::Model&));
    void changed(const std::vector<Document*>& documents);
    std::vector<std::string> places_of(const Document& document) const;

    void save(Document& document);
    void put(Document& document);
    void settle();
    void take_away(Document& made);
    void put_back(Document& made);

    std::vector<std::unique_ptr<Document>> documents_;  ///< the opened one first
    std::vector<std::unique_ptr<Document>> taken_away_; ///< made by edits that are undone
    std::vector<Step> done_, undone_;
    std::int64_t revision_ = 0;
    std::string collision_;
    Moves moves_;
    const std::unique_ptr<Disk> disk_;
};

} // namespace bf::service
