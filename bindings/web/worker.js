// Behind the module's own script, in a worker: runs one scene and talks with the page as `deform serve` does
// with its viewers. The first message brings the module, the files and the scene; the others are requests.
"use strict";
const kPicture = 1 / 30;  // s
const refuse = error => postMessage(JSON.stringify({ refused: String(error) }));
async function begin({ module, files, scene }) {
  const early = [];
  onmessage = message => early.push(message);
  const deform = await makeDeform({
    instantiateWasm(imports, done) {
      WebAssembly.instantiate(module, imports).then(done).catch(refuse);
      return {};
    },
    give: message => postMessage(message, typeof message === "string" ? [] : [message]),
  });
  for (const [path, bytes] of files) {
    deform.FS.mkdirTree(path.slice(0, path.lastIndexOf("/")));
    deform.FS.writeFile(path, bytes);
  }
  const call = (name, ...given) => deform.ccall(name, "number", given.map(x => typeof x), given);
  const runs = call("deform_open", scene);
  onmessage = ({ data }) => data === "join" ? call("deform_join") : call("deform_ask", data);
  call("deform_join");
  early.forEach(onmessage);
  if (!runs) return;
  let next = performance.now();
  const picture = () => {
    call("deform_picture", kPicture);
    next = Math.max(next + 1000 * kPicture, performance.now());
    setTimeout(picture, next - performance.now());
  };
  picture();
}
onmessage = ({ data }) => begin(data).catch(refuse);
