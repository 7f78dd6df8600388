# Writes OUTPUT, a C++ file that holds the text of each of FILES (relative to FOLDER) under its path "shaders/...".
set(text "#include \"shaders/embedded_shaders.h\"\n\nnamespace freevoxel {\n\n")
string(APPEND text "std::string_view embeddedShader(std::string_view path) {\n")
foreach(name IN LISTS FILES)
  file(READ ${FOLDER}/${name} body)
  string(APPEND text "  if (path == \"shaders/${name}\") {\n    return R\"=====(${body})=====\";\n  }\n")
endforeach()
string(APPEND text "  return {};\n}\n\n}  // namespace freevoxel\n")
file(WRITE ${OUTPUT} "${text}")
