// A Simulink library of masked blocks, as a text model file.
#include "simulink_library.hpp"

#include "bf/base/escape.hpp"
#include "bf/boundary/positional.hpp"
#include "output.hpp"

#include <algorithm>

namespace bf::tools {

namespace {

using boundary::PositionalValue;

/// In double quotes, as the file wants it.
std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '\n') {
            result += "\\n";
            continue;
        }
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

std::string replaced(std::string text, char from, const std::string& to) {
    for (std::size_t i = 0; (i = text.find(from, i)) != std::string::npos; i += to.size())
        text.replace(i, 1, to);
    return text;
}

std::string expression(const Value& value) {
    std::string text;
    if (value.kind == Value::Kind::text) return escape::matlab(value.text);
    if (value.kind == Value::Kind::texts) {
        for (const auto& item : value.texts) text += (text.empty() ? "" : ",") + escape::matlab(item);
        return "{" + text + "}";
    }
    for (int i = 0; i < value.rows; ++i)
        for (int j = 0; j < value.cols; ++j)
            text += (j   ? " "
                     : i ? ";"
                         : "") +
                    number(value.data[static_cast<std::size_t>(i + j * value.rows)]);
    return value.data.size() == 1 ? text : "[" + text + "]";
}

/// The name of a mask's variable; MATLAB keeps some words for itself.
std::string variable_name(const std::string& name) {
    for (const char* kept :
         {"break",      "case",   "catch",    "classdef", "continue", "else",      "elseif",
          "end",        "for",    "function", "global",   "if",       "otherwise", "parfor",
          "persistent", "return", "spmd",     "switch",   "try",      "while"})
        if (name == kept) return name + "_";
    return name;
}

/// One line of a mask: how a value is asked for.
struct Field {
    std::string prompt, style, variable, value;
    bool is_tunable, is_literal;
};

Field field_of(const PositionalValue& value) {
    const bool is_period = value.goal == PositionalValue::Goal::period;
    const bool is_switch = value.initial.kind == Value::Kind::number && value.initial.type == Type::boolean &&
                           value.initial.data.size() == 1 && value.goal == PositionalValue::Goal::argument;
    const std::string doc = with_limits(value.doc, value.limits);
    Field field{value.metadata.name + (doc.empty() ? "" : ": " + doc),
                "edit",
                variable_name(value.metadata.name),
                expression(value.initial),
                value.goal == PositionalValue::Goal::parameter,
                false};
    if (is_period) {
        field.prompt += "; -1: inherited";
        field.value = "-1";
    } else if (is_switch) {
        field.style = "checkbox";
        field.value = value.initial.data[0] != 0 ? "on" : "off";
    } else if (!value.choices.empty()) {
        std::string choices;
        for (const auto& choice : value.choices) choices += (choices.empty() ? "" : "|") + choice;
        field.style = "popup(" + choices + ")";
        field.value = value.initial.text;
        field.is_literal = true;
    }
    return field;
}

class Writer {
  public:
    std::string text;

    void open(const std::string& kind) {
        line(kind + " {");
        ++depth_;
    }
    void close() {
        --depth_;
        line("}");
    }
    void put(const std::string& key, const std::string& value) { line(key + "\t" + value); }
    void put_text(const std::string& key, const std::string& value) { put(key, quoted(value)); }

  private:
    void line(const std::string& content) {
        text += std::string(static_cast<std::size_t>(2 * depth_), ' ') + content + "\n";
    }
    int depth_ = 0;
};

std::string list_of(const std::vector<Field>& fields, const char* separator, auto&& of) {
    std::string list;
    for (std::size_t i = 0; i < fields.size(); ++i) list += (i ? separator : "") + of(fields[i]);
    return list;
}

/// Names of the ports as far as they do not move with the arguments.
std::string port_labels(const Declared& block) {
    std::string labels;
    for (const Role role : {Role::input, Role::output}) {
        int port = 0;
        for (const auto& q : block.quantities) {
            if (q.role != role) continue;
            if (!q.condition.empty()) break;
            labels += "port_label(" + std::string(role == Role::input ? "'input'" : "'output'") + "," +
                      std::to_string(++port) + "," + escape::matlab(q.name) + ");\n";
        }
    }
    return labels;
}

std::string help(const Declared& block) {
    std::string text = block.doc + "\n";
    for (const auto& [role, heading] : shown_roles) {
        bool is_first = true;
        for (const auto& q : block.quantities) {
            if (q.role != role) continue;
            if (is_first) text += "\n" + std::string(heading) + ":\n";
            is_first = false;
            text += "  " + q.name + "  " + q.size + "  " + q.type + (q.unit == "any" ? "" : "  " + q.unit) +
                    (q.doc.empty() ? "" : "  " + with_limits(q.doc, q.limits, q.at_least)) +
                    (q.condition.empty() ? "" : " (only with " + q.condition + ")") + "\n";
        }
    }
    for (const auto& need : block.needs) text += "\nNeeds a " + need.type + " around it: " + need.doc + ".\n";
    for (const auto& provided : block.provides)
        text += "\nProvides a " + provided.type + " to its subsystem and below.\n";
    return text;
}

std::string position(int index, int width, int height) {
    constexpr int columns = 4, step_x = 200, step_y = 120;
    const int x = 40 + index % columns * step_x, y = 40 + index / columns * step_y;
    return "[" + std::to_string(x) + ", " + std::to_string(y) + ", " + std::to_string(x + width) + ", " +
           std::to_string(y + height) + "]";
}

void write_block(Writer& file, const BlockClass& type, int index) {
    const Declared block = declared(type);
    const std::string library = type.library.empty() ? "standard" : type.library;
    std::vector<Field> fields;
    std::string parameters = escape::matlab(type.name) + "," + escape::matlab(library);
    unsigned last = 1;
    for (const auto& value : boundary::positional_values(type)) {
        fields.push_back(field_of(value));
        // Fields of one struct of an old block are one parameter.
        const auto type_number = static_cast<int>(value.metadata.type);
        const bool is_field = type_number >= static_cast<int>(blockfactory::core::ParameterType::STRUCT_INT);
        const std::string own =
            is_field ? escape::matlab(value.metadata.name) + ",{" + fields.back().variable + "}"
                     : fields.back().variable;
        if (!is_field)
            parameters += "," + own;
        else if (value.metadata.index == last)
            parameters.insert(parameters.size() - 1, "," + own);
        else
            parameters += ",struct(" + own + ")";
        last = value.metadata.index;
    }
    const auto made = type.make({});
    int inputs = 0, outputs = 0;
    for (const auto& slot : made->resolution().slots) {
        inputs += slot.role == Role::input;
        outputs += slot.role == Role::output;
    }
    file.open("Block");
    file.put_text("BlockType", "S-Function");
    file.put_text("Name", type.name);
    file.put("Ports", "[" + std::to_string(inputs) + ", " + std::to_string(outputs) + "]");
    file.put("Position", position(index, 120, 70));
    file.put_text("FunctionName", "BlockFactory");
    file.put_text("Parameters", parameters);
    file.put_text("MaskType", type.qualified_name());
    file.put_text("MaskDescription", block.doc);
    file.put_text("MaskHelp", help(block));
    // A bar separates fields; within one it is escaped.
    file.put_text("MaskPromptString",
                  list_of(fields, "|", [](const Field& f) { return replaced(f.prompt, '|', "\\|"); }));
    file.put_text("MaskStyleString", list_of(fields, ",", [](const Field& f) { return f.style; }));
    int number_of_field = 0;
    file.put_text("MaskVariables", list_of(fields, "", [&](const Field& f) {
                      return f.variable + "=" + (f.is_literal ? "&" : "@") +
                             std::to_string(++number_of_field) + ";";
                  }));
    file.put_text("MaskTunableValueString", list_of(fields, ",", [](const Field& f) {
                      return std::string(f.is_tunable ? "on" : "off");
                  }));
    file.put_text("MaskValueString",
                  list_of(fields, "|", [](const Field& f) { return replaced(f.value, '|', "\\|"); }));
    file.put_text("MaskDisplay", port_labels(block));
    file.put("MaskIconFrame", "on");
    file.put("MaskIconOpaque", "on");
    file.put_text("MaskIconRotate", "none");
    file.put_text("MaskIconUnits", "autoscale");
    file.close();
}

} // namespace

std::string simulink_library(const std::string& name, const std::vector<const BlockClass*>& classes) {
    std::vector<std::string> groups;
    for (const auto* type : classes)
        if (std::find(groups.begin(), groups.end(), type->group) == groups.end())
            groups.push_back(type->group);
    Writer file;
    file.open("Library");
    file.put_text("Name", name);
    file.put("Version", "7.8");
    file.put_text("SavedCharacterEncoding", "UTF-8");
    file.put_text("LibraryType", "BlockLibrary");
    file.open("System");
    file.put_text("Name", name);
    file.put("Location", "[100, 100, 960, 700]");
    file.put("Open", "on");
    int index = 0;
    for (const auto& group : groups) {
        file.open("Block");
        file.put("BlockType", "SubSystem");
        file.put_text("Name", group);
        file.put("Ports", "[]");
        file.put("Position", position(index++, 120, 70));
        file.open("System");
        file.put_text("Name", group);
        file.put("Location", "[140, 140, 1000, 740]");
        file.put("Open", "off");
        int place = 0;
        for (const auto* type : classes)
            if (type->group == group) write_block(file, *type, place++);
        file.close();
        file.close();
    }
    file.close();
    file.close();
    return file.text;
}

} // namespace bf::tools
