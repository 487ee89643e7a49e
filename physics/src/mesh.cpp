#include "mesh.hpp"

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::physics {

namespace fs = std::filesystem;

bool mujoco_reads(const fs::path& file) {
    std::string ending = file.extension();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (ending != ".stl") return ending == ".obj" || ending == ".msh";
    // The binary form has 80 bytes of title, the number of triangles and 50 bytes for each.
    std::array<char, 84> head{};
    std::uint32_t triangles = 0;
    if (!std::ifstream(file, std::ios::binary).read(head.data(), head.size())) return false;
    std::memcpy(&triangles, &head[80], sizeof triangles);
    return fs::file_size(file) == 84 + 50ull * triangles;
}

void import_mesh(mjsMesh* mesh, const fs::path& file) {
    Assimp::Importer importer;
    // ROS ignores which axis a COLLADA file calls upwards.
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_SortByPType |
                                                                aiProcess_PreTransformVertices |
                                                                aiProcess_JoinIdenticalVertices);
    std::vector<float> vertices;
    std::vector<int> faces;
    for (unsigned i = 0; scene && i < scene->mNumMeshes; ++i) {
        const aiMesh& part = *scene->mMeshes[i];
        const int first = static_cast<int>(vertices.size() / 3);
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            const aiVector3D& p = part.mVertices[v];
            vertices.insert(vertices.end(), {p.x, p.y, p.z});
        }
        for (unsigned f = 0; f < part.mNumFaces; ++f)
            for (unsigned c = 0; c < 3; ++c)
                faces.push_back(first + static_cast<int>(part.mFaces[f].mIndices[c]));
    }
    if (faces.empty())
        throw std::runtime_error(
            "the mesh '" + file.string() + "' cannot be read" +
            (scene ? ": it has no faces" : ": " + std::string(importer.GetErrorString())));
    mjs_setString(mesh->file, "");
    mjs_setString(mesh->content_type, "");
    mjs_setFloat(mesh->uservert, vertices.data(), static_cast<int>(vertices.size()));
    mjs_setInt(mesh->userface, faces.data(), static_cast<int>(faces.size()));
}

} // namespace bf::physics
