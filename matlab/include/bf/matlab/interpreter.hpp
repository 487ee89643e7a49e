#pragma once

#include "bf/matlab/syntax.hpp"
#include "bf/matlab/workspace.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bf::matlab {

/// What a script may reach outside its variables. The defaults refuse: a text from a model file must not
/// read files or the environment unless its host says so.
class Host {
  public:
    virtual ~Host() = default;

    /// The text of the script that `run(path)` names; its errors carry `path`. Throws Error.
    virtual std::string read_script(const std::string& path);
    /// The text of the file that defines `name` (`skew`, `wbc.skew`), if there is one on the path.
    virtual std::optional<std::string> find_function(const std::string& name);
    /// A function the host implements itself, such as a class constructor; none by default.
    virtual std::optional<Value> call(const std::string& name, const std::vector<Value>& arguments);
    virtual void add_path(const std::string& folder);             ///< throws Error
    virtual std::string environment(const std::string& variable); ///< `getenv`; throws Error
    virtual bool exists(const std::string& path,
                        const std::string& kind); ///< kind `file` or `dir`; throws Error
    virtual void show(const std::string& text);   ///< disp, fprintf, warning; ignored by default
};

/// Bounds that turn hostile text into an Error.
struct Limits {
    double elements = 1e7; ///< of one array
    double work = 5e8;     ///< elementary operations of one `evaluate` or `run`
    int depth = 1000;      ///< nested expressions and calls
};

/// Evaluates expressions and runs scripts. Names resolve in this order: variable, function of the same
/// file, host's function, built-in. Keeps parsed function files and persistent variables; not for
/// concurrent use.
class Interpreter {
  public:
    Interpreter();
    explicit Interpreter(Host& host, const Limits& limits = {}); ///< `host` outlives the interpreter
    ~Interpreter();
    Interpreter(Interpreter&&) noexcept;

    /// The value of one expression. Variables are read from `variables`, `start` says where the text
    /// stands. Throws Error.
    Value evaluate(std::string_view text, const Workspace& variables, const Location& start = {});
    Value evaluate(const Expression& expression, const Workspace& variables);

    /// Runs a script in `variables`, which keeps what was assigned before an Error.
    void run(std::string_view script, Workspace& variables, const Location& start = {});
    void run(const std::shared_ptr<const Program>& program, Workspace& variables);

    /// Calls the first function of a function file with positional arguments; returns `outputs` values.
    std::vector<Value> call(const std::shared_ptr<const Program>& program, std::vector<Value> arguments,
                            int outputs);

  private:
    class State;
    std::unique_ptr<State> state_;
};

/// `Interpreter().evaluate(...)` for expressions that need no host.
Value evaluate(std::string_view text, const Workspace& variables, const Location& start = {});

/// The number a plain literal (`0.999`, `-3`, `1e-5`, blanks around) stands for; anything else gives none.
std::optional<double> plain_number(std::string_view text);

bool is_builtin(std::string_view name);

/// The variables an expression depends on, in order of first use: names that are not parameters of an
/// enclosing `@(...)`, and not functions. A built-in's name counts when `variables` defines it.
std::vector<std::string> free_variables(const Expression& expression,
                                        const Workspace& variables = Workspace());

} // namespace bf::matlab
