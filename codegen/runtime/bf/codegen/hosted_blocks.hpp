// The blocks behind Hosted: made from plugins, working on the memory of the generated class.
#pragma once

#include "bf/codegen/blocks_in_context.hpp"
#include "bf/codegen/parameter_file.hpp"

#include "bf/core/registry.hpp"
#include "bf/core/resolve.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::generated {

inline Value value(bf::Type type, int rows, int cols, std::vector<double> data) {
    Value v;
    v.type = type;
    v.rows = rows;
    v.cols = cols;
    v.data = std::move(data);
    return v;
}

/// A quantity of a block and the memory where it lies; `next` and `rate` of states.
struct HostedSlot {
    const char* name;
    Role role;
    bf::Type type;
    Size size;
    Context::Memory memory;
};

class HostedBlocks final : public BlocksInContext {
  public:
    /// Relative file names in the blocks' arguments are meant from `folder`.
    HostedBlocks(std::string folder, std::vector<double> periods) : folder_(std::move(folder)) {
        periods_ = std::move(periods);
    }
    ~HostedBlocks() override { stop(); }

    Registry& registry() { return registry_; }

    /// Values for arguments, by block.argument, instead of those that blocks are added with.
    void change_arguments(const std::vector<Entry>& changed) { changed_ = changed; }

    /// Makes a block; `subfolder` is that of its model file. Throws std::runtime_error naming the block.
    void add(const char* path, const char* type, int rate, Arguments arguments, const char* subfolder,
             std::vector<HostedSlot> slots, std::vector<Node::End> providers) {
        attempt(path, [&] {
            arguments.folder = (std::filesystem::path(folder_) / subfolder).lexically_normal().string();
            const BlockClass& found = registry_.find(type);
            change(path, found, arguments);
            Item item{path, found.make(arguments), std::move(slots), false};
            const auto& d = item.block->declaration();
            if (!d.problems.empty()) throw std::runtime_error(d.problems.front());
            if (providers.size() != d.requirements.size()) throw std::runtime_error(is_another_version());
            nodes_.push_back({item.block.get(), found.methods, {}, std::move(providers), rate});
            nodes_.back().sources.resize(d.slots.size());
            items_.push_back(std::move(item));
        });
    }

    struct TaskOf {
        int block;
        Phase phase;
        int index;
    };
    /// After the last block: resources, sizes, memory, and the tasks that run() knows by their place in the
    /// list.
    void finish(const std::vector<TaskOf>& tasks) {
        for (std::size_t k = 0; k < items_.size(); ++k) resolve(k);
        own_context_ = std::make_unique<Context>(nodes_, static_cast<int>(periods_.size()));
        context_ = own_context_.get();
        for (std::size_t k = 0; k < items_.size(); ++k)
            for (const auto& slot : items_[k].slots)
                if (slot.memory.now)
                    context_->use_memory(static_cast<int>(k), find(items_[k], slot), slot.memory);
        add_events();
        for (const auto& task : tasks) {
            if (task.index >= context_->activities(task.block, task.phase))
                throw std::runtime_error(items_[static_cast<std::size_t>(task.block)].path + ": " +
                                         is_another_version());
            add_task(task.block, task.phase, task.index);
        }
    }

  private:
    struct Item {
        std::string path;
        std::unique_ptr<Block> block;
        std::vector<HostedSlot> slots;
        bool is_resolved = false;
    };
    int count() const override { return static_cast<int>(items_.size()); }
    const std::string& path(int block) const override { return items_[static_cast<std::size_t>(block)].path; }
    const Block& block(int block) const override { return *items_[static_cast<std::size_t>(block)].block; }

    static const char* is_another_version() {
        return "the block has other ports or sizes than the code was generated for; generate it again, with "
               "the arguments that were changed";
    }
    void change(const std::string& path, const BlockClass& type, Arguments& arguments) const {
        for (const Entry& entry : changed_) {
            if (entry.name.rfind('.') != path.size() || entry.name.compare(0, path.size(), path) != 0)
                continue;
            const std::string name = entry.name.substr(path.size() + 1);
            Value given;
            const auto defaults = type.make({});
            for (const auto& known : defaults->declaration().arguments) {
                if (known.name != name) continue;
                if (known.initial.kind == Value::Kind::text) {
                    given = Value(entry.text);
                } else if (known.initial.kind == Value::Kind::texts) {
                    given = Value(entry.items);
                } else {
                    std::vector<double> numbers;
                    if (const std::string wrong = detail::numbers_of(entry, numbers); !wrong.empty())
                        throw std::runtime_error("argument '" + name + "': " + wrong);
                    given = value(bf::Type::float64, entry.rows, entry.cols, std::move(numbers));
                }
            }
            const auto same = std::find_if(arguments.begin(), arguments.end(),
                                           [&](const auto& argument) { return argument.first == name; });
            if (same == arguments.end())
                arguments.emplace_back(name, std::move(given));
            else
                same->second = std::move(given);
        }
    }
    template <class F> static void attempt(const std::string& path, F&& f) {
        try {
            f();
        } catch (const std::exception& error) {
            throw std::runtime_error(path + ": " + error.what());
        }
    }
    static int find(const Item& item, const HostedSlot& slot) {
        const int index = item.block->declaration().find(slot.name, slot.role);
        if (index < 0)
            throw std::runtime_error(item.path + ": has no '" + slot.name + "'; " + is_another_version());
        return index;
    }
    /// Binds what the block requires, then makes what it provides, then settles its sizes.
    void resolve(std::size_t k) {
        Item& item = items_[k];
        if (item.is_resolved) return;
        item.is_resolved = true;
        Resolution& r = item.block->resolution();
        for (std::size_t i = 0; i < r.required.size(); ++i) {
            const Node::End& from = nodes_[k].providers[i];
            resolve(static_cast<std::size_t>(from.node));
            const auto& provided = items_[static_cast<std::size_t>(from.node)].block->resolution().provided;
            if (from.slot >= static_cast<int>(provided.size()))
                throw std::runtime_error(item.path + ": " + is_another_version());
            require(*item.block, static_cast<int>(i), provided[static_cast<std::size_t>(from.slot)]);
        }
        attempt(item.path, [&] {
            provide(*item.block);
            for (const auto& slot : item.slots) {
                offer(r, find(item, slot), slot.size);
                offer(r, find(item, slot), slot.type);
            }
            propagate(*item.block);
            if (!unresolved(r).empty()) throw std::runtime_error(is_another_version());
        });
    }

    std::string folder_;
    std::vector<Entry> changed_;
    Registry registry_;
    std::vector<Item> items_; // their code is in the registry's plugins
    std::vector<Node> nodes_;
    std::unique_ptr<Context> own_context_;
};

} // namespace bf::generated
