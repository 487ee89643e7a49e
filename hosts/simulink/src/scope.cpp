#include "scope.hpp"

#include "bf/core/resolve.hpp"

#include <algorithm>
#include <stdexcept>

namespace bf::simulink {

std::string parent(const std::string& path) {
    for (std::size_t i = path.size(); i-- > 0;) {
        if (path[i] != '/') continue;
        if (i > 0 && path[i - 1] == '/')
            --i; // part of a name
        else
            return path.substr(0, i);
    }
    return "";
}

Scope& Scope::instance() {
    static Scope only;
    return only;
}

void Scope::enter(const std::string& path, const BlockClass& type, const Arguments& arguments) {
    leave(path);
    auto block = type.make(arguments);
    const std::size_t count = block->declaration().provisions.size();
    providers_.push_back(std::make_shared<Provider>(Provider{path, &type, arguments, std::move(block),
                                                             std::vector<Object>(count),
                                                             std::vector<std::weak_ptr<void>>(count)}));
}

void Scope::leave(const std::string& path) {
    std::erase_if(providers_, [&](const auto& provider) { return provider->path == path; });
}

std::shared_ptr<Scope::Provider> Scope::find(const std::string& path) const {
    for (const auto& provider : providers_)
        if (provider->path == path) return provider;
    return nullptr;
}

std::vector<Scope::Binding> Scope::bind(const std::string& path, Block& block) {
    const auto& requirements = block.declaration().requirements;
    std::vector<Binding> bindings(requirements.size());
    for (std::size_t i = 0; i < bindings.size(); ++i) {
        const std::string& type = requirements[i].type;
        auto& binding = bindings[i];
        for (std::string around = parent(path); !around.empty() && !binding.provider; around = parent(around))
            for (const auto& provider : providers_) {
                if (parent(provider->path) != around || provider->path == path) continue;
                const auto& offered = provider->block->declaration().provisions;
                for (std::size_t k = 0; k < offered.size(); ++k) {
                    if (offered[k].type != type) continue;
                    if (binding.provider)
                        throw std::runtime_error("two blocks of one subsystem provide a " + type + ": '" +
                                                 binding.provider->path + "' and '" + provider->path + "'");
                    binding = {provider, k};
                }
            }
        if (binding.provider && !block.resolution().required[i])
            require(block, static_cast<int>(i), description(*binding.provider, binding.provision));
    }
    return bindings;
}

std::shared_ptr<const void> Scope::description(Provider& provider, std::size_t k) {
    const auto& d = provider.block->declaration();
    for (const auto& problem : d.problems) throw std::runtime_error(provider.path + ": " + problem);
    const auto bindings = bind(provider.path, *provider.block);
    for (std::size_t i = 0; i < bindings.size(); ++i)
        if (!bindings[i].provider)
            throw std::runtime_error(provider.path + " needs a " + d.requirements[i].type + " around it");
    try {
        provide(*provider.block);
    } catch (const std::exception& error) {
        throw std::runtime_error(provider.path + ": " + error.what());
    }
    return provider.block->resolution().provided[k];
}

Object Scope::open(Provider& provider, std::size_t k) {
    Object object = provider.live[k];
    object.pointer = provider.alive[k].lock();
    if (object.pointer) return object;
    const auto made = description(provider, k);
    object = provider.block->declaration().provisions[k].open(made.get());
    provider.alive[k] = object.pointer;
    provider.live[k] = object;
    provider.live[k].pointer.reset();
    return object;
}

} // namespace bf::simulink
