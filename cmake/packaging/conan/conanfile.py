"""Conan 2 recipe: conan create cmake/packaging/conan

Builds the tree that it lies in. What the library is compiled with comes from the remote, or, with
-o "deform/*:system=True", from the system's packages, for which no remote is asked.
"""
import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import cross_building
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load
from conan.tools.system.package_manager import Apt

required_conan_version = ">=2.0"


class Deform(ConanFile):
    name = "deform"
    license = "MIT"
    description = "soft bodies that touch each other with true friction"
    topics = ("physics", "simulation", "soft-body", "friction", "finite-elements")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False], "cli": [True, False], "system": [True, False]}
    default_options = {"shared": True, "fPIC": True, "cli": False, "system": False}
    implements = ["auto_shared_fpic"]

    def _root(self):
        return os.path.normpath(os.path.join(self.recipe_folder, "..", "..", ".."))

    def set_version(self):
        text = load(self, os.path.join(self._root(), "CMakeLists.txt"))
        self.version = re.search(r"project\(deform VERSION ([\d.]+)", text).group(1)

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "README.md", "CHANGELOG.md", "cmake/*",
                        "libdeform/CMake*", "libdeform/include/*", "libdeform/schema/*",
                        "libdeform/src/*", "plugins/*",
                        "bindings/*", "examples/scenes/two_cylinders.json", "examples/data/cylinder_*.msh"):
            copy(self, pattern, self._root(), self.export_sources_folder, excludes="*__pycache__*")

    def layout(self):
        cmake_layout(self)

    def validate(self):
        if (self.settings.os, self.settings.arch) not in (("Linux", "x86_64"), ("Linux", "armv8"),
                                                          ("Windows", "x86_64")):
            raise ConanInvalidConfiguration("deform is tested on Linux (x86_64, armv8) and Windows (x86_64)")
        if self.settings.compiler not in ("gcc", "clang"):
            raise ConanInvalidConfiguration("deform is developed and tested with gcc and clang alone")

    def requirements(self):
        if not self.options.system:
            self.requires("eigen/3.4.0", visible=False)
            self.requires("nlohmann_json/3.11.3", visible=False)
            self.requires("zlib/[>=1.2.11 <2]")
            if self.options.cli:
                self.requires("cli11/2.4.2", visible=False)

    def system_requirements(self):
        if self.options.system:
            cli = ["libcli11-dev"] if self.options.cli else []
            # headers serve every system; another one has zlib from its toolchain, or none
            zlib = [] if cross_building(self) else ["zlib1g-dev"]
            Apt(self).install(["libeigen3-dev", "nlohmann-json3-dev", *zlib, *cli], host_package=False)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables.update({
            "DEFORM_SHARED": bool(self.options.shared),
            "DEFORM_PLUGINS_STATIC": not self.options.shared,  # an archive has no folder beside it
            "DEFORM_CLI": bool(self.options.cli), "DEFORM_RENDER": False, "DEFORM_TESTS": False,
            "DEFORM_EXAMPLES": False, "DEFORM_VIEW": "OFF", "DEFORM_ODE": "OFF", "DEFORM_BULLET": "OFF",
            "DEFORM_ASSIMP": "OFF"})
        if self.options.system and cross_building(self):   # its files may lack zlib, and so compressed VTU
            toolchain.cache_variables["DEFORM_ZLIB"] = self.settings.os == "Windows"
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build(target="deform_tools")

    def package(self):
        for component in ("library", "dev", "command"):   # the pages are no part of a package
            CMake(self).install(component=component)
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        # CMake takes the package's own files, which have deform_add_plugin; others take what follows.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.set_property("pkg_config_name", "deform")
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "deform")]
        self.cpp_info.libs = ["deform"]
        if not self.options.shared:
            self.cpp_info.system_libs = ["stdc++", "m", "pthread"] + (["z"] if self.options.system else [])
