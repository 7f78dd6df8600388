// The program that reads meshes with Assimp while the tests run: what freevoxel does when started as such a reader.
#include "voxlink/read_mesh.h"

int main() {
  freevoxel::runMeshReader();
}
