# OpenVDB and GDCM, whose own CMake files want more than their Debian packages hold, and Assimp. Their headers are theirs
# to warn of.

function(freevoxel_find_library target header folder)
  find_path(${target}_INCLUDE ${header} PATH_SUFFIXES ${folder} REQUIRED)
  add_library(${target} INTERFACE IMPORTED)
  target_include_directories(${target} SYSTEM INTERFACE ${${target}_INCLUDE})
  foreach(name ${ARGN})
    find_library(${target}_${name} ${name} REQUIRED)
    target_link_libraries(${target} INTERFACE ${${target}_${name}})
  endforeach()
endfunction()

freevoxel_find_library(OpenVDB::openvdb openvdb/openvdb.h "" openvdb tbb Imath)
freevoxel_find_library(GDCM::gdcm gdcmImageReader.h gdcm-3.0 gdcmMSFF gdcmDSED gdcmDICT gdcmCommon)
freevoxel_find_library(Assimp::assimp assimp/Importer.hpp "" assimp)
