#pragma once

#include <exception>
#include <memory>
#include <string>
#include <vector>

namespace bf::model {

/// A place in a file. Line and column count from 1; line 0 means "made by a program, stands in no file".
struct Location {
    std::shared_ptr<const std::string> file;
    int line = 0;
    int column = 0;

    explicit operator bool() const { return line > 0; }

    /// `file:line:column`, or an empty text for no place.
    std::string text() const;
};

/// What would mend a mistake: an operation on the document (bf/model/operation.hpp) in its text form, and
/// what it does, in words.
struct Fix {
    std::string title, operation;
};

/// One thing wrong with a model: where, what, and what to do about it.
struct Diagnostic {
    Location where;
    std::string path;    ///< dotted path of the block, such as `controller.pd`; empty for the model itself
    std::string message; ///< what is wrong, with the value and the violated rule
    std::string remedy;  ///< what to do; may be empty
    std::vector<Fix> fixes = {}; ///< where the remedy is mechanical, the likeliest first
    bool is_open = false;        ///< a port that has no wire yet
    std::string variable = {};   ///< the variable that has the wrong value, by its path

    /// `file:line:column: path: message; remedy`, each shortened where it is longer than anybody reads.
    std::string text() const;
};

/// All that is wrong with a model, thrown once.
class Errors : public std::exception {
  public:
    explicit Errors(std::vector<Diagnostic> diagnostics);

    const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

    /// One line per diagnostic; of more than a hundred the first ones, and how many more there are.
    const char* what() const noexcept override { return text_.c_str(); }

  private:
    std::vector<Diagnostic> diagnostics_;
    std::string text_;
};

} // namespace bf::model
