# What CPack makes a Debian package of: a folder, as scripts/package-debian lays it out.
#   FOLDER=... NAME=... VERSION=... cpack --config cmake/DebianPackage.cmake -B OUTPUT
foreach(variable FOLDER NAME VERSION)
    set(${variable} $ENV{${variable}})
endforeach()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ${NAME})
set(CPACK_PACKAGE_VERSION ${VERSION})
set(CPACK_PACKAGE_FILE_NAME ${NAME}) # of its folder of work
set(CPACK_PACKAGE_CONTACT "the authors of BlockFactory <blockfactory@localhost>")
set(CPACK_INSTALLED_DIRECTORIES "${FOLDER};/")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd) # xz makes two thirds of it, in ten times the time
set(CPACK_THREADS 0) # all processors
set(CPACK_STRIP_FILES OFF)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

if(NAME STREQUAL blockfactory)
    set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "design, simulate and run robot controllers as block diagrams")
    set(CPACK_PACKAGE_DESCRIPTION "The program bf with the editor's page, the standard blocks, the Whole-Body Toolbox, the Python package,
and the headers and CMake package with which blocks are written. It carries Pinocchio, MuJoCo and what
those need, which Debian has not, in a folder of its own.")
    # Debian's own libraries by what the binaries say of them; the others lie in the package.
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
    set(home ${FOLDER}/usr/lib/blockfactory)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${home}/cmeel.prefix/lib ${home}/mujoco ${home}/blockfactory/lib)
    # The extension module is compiled for this Python.
    set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy")
    set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "blockfactory-icub, gnuplot-nox, fonts-dejavu-core")
    set(CPACK_DEBIAN_PACKAGE_SUGGESTS
        "ffmpeg, libosmesa6, g++, cmake, libeigen3-dev, python3-matplotlib, python3-pandas, python3-xarray")
else()
    set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "models of the iCub for blockfactory")
    set(CPACK_PACKAGE_DESCRIPTION "The URDF models and meshes of the wheel icub-models, where bf looks for robots.")
    set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE all)
endif()
