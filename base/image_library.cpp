#include "base/image_library.h"

#include <dlfcn.h>

#include "base/error.h"

namespace freevoxel {

const ImageLibrary& imageLibrary() {
  static const ImageLibrary* const library = [] {
    // Stays loaded until the process ends. Found by the run path of the program.
    void* const module = dlopen(FREEVOXEL_IMAGE_MODULE, RTLD_NOW | RTLD_LOCAL);
    void* const entry = module == nullptr ? nullptr : dlsym(module, kImageLibraryEntry);
    if (entry == nullptr) throw MachineError(fmt::format("cannot load the module for image files: {}", dlerror()));
    return reinterpret_cast<ImageLibraryEntry>(entry)();
  }();
  return *library;
}

}  // namespace freevoxel
