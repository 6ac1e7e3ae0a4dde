// Looks words up in the generator's index. Its own search starts a worker and fetches the index, and a browser
// refuses both to a page that is opened from a folder; a script it loads.

// The part of a word by which its forms are found: "installation" and "installed" by "install".
function stem(word) {
  var cut = word.replace(/(ations?|ings?|ers?|ed|es|s)$/, "");
  return cut.length >= 3 ? cut : word;
}

// Every word must occur. A word counts more in the title, most where it is the title, and in the question
// that the page answers. What a user seldom looks for counts less: decisions, changes, sources, names of the
// API.
function score(entry, words) {
  var title = entry.title.toLowerCase(), text = entry.text.toLowerCase();
  var answers = (entry.answers || "").toLowerCase(), sum = 0;
  for (var i = 0; i < words.length; i++) {
    var part = stem(words[i]), times = text.split(part).length - 1;
    var named = title === words[i] ? 100 : title.indexOf(part) >= 0 ? 30 : 0;
    var asked = answers.indexOf(part) >= 0 ? 60 : 0;
    if (!times && !named && !asked) return 0;
    sum += named + asked + Math.min(times, 10);
  }
  var seldom = /decisions\/|^CHANGELOG|\.(c|h|cpp|hpp|py|json|csv|txt)\.html/.test(entry.location);
  return sum * (seldom ? 0.3 : /^api\//.test(entry.location) ? 0.6 : 1);
}

// The entries that have the words, the best first. The text of a page holds that of its sections: the page
// itself is told where it is before them, or where none of them has all words.
function rank(pages, words) {
  var found = pages.map(function (entry) { return {entry: entry, score: score(entry, words)}; })
    .filter(function (f) { return f.score > 0; }).sort(function (a, b) { return b.score - a.score; });
  return found.filter(function (f, i) {
    return f.entry.location.indexOf("#") >= 0 || !found.some(function (g, k) {
      return g.entry.location.indexOf(f.entry.location + "#") === 0 && (k < i || g.score === f.score);
    });
  }).map(function (f) { return f.entry; });
}

if (typeof module !== "undefined") module.exports = {rank: rank};
else (function () {
  "use strict";
  var field = document.getElementById("query"), results = document.getElementById("results");
  var article = document.querySelector("main > article"), loading = false;

  function load(then) {
    if (window.pages) return then();
    if (loading) return;
    loading = true;
    var script = document.createElement("script");
    script.src = index;
    script.onload = then;
    script.onerror = function () {
      loading = false;
      results.hidden = false;
      results.textContent = "The index of the search could not be loaded: reload this page.";
    };
    document.head.appendChild(script);
  }

  function plain(text) {
    var box = document.createElement("textarea");
    box.innerHTML = text;
    return box.value;
  }

  function piece(text, word) {
    var at = Math.max(0, text.toLowerCase().indexOf(word) - 80), p = document.createElement("p");
    var shown = (at ? ".. " : "") + text.slice(at, at + 220).replace(/\s+/g, " ") + " ..";
    shown.split(new RegExp("(" + word.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") + ")", "i")).forEach(
      function (part, i) {
        var node = document.createElement(i % 2 ? "mark" : "span");
        node.textContent = part;
        p.appendChild(node);
      });
    return p;
  }

  function show() {
    var words = field.value.toLowerCase().split(/\s+/).filter(function (w) { return w.length > 1; });
    results.hidden = !words.length;
    article.hidden = !results.hidden;
    if (results.hidden) return;
    var titles = {};
    window.pages.forEach(function (entry) {
      if (entry.location.indexOf("#") < 0) titles[entry.location] = entry.title;
    });
    var found = rank(window.pages, words);
    results.textContent = "";
    var head = document.createElement("h1");
    head.textContent = found.length ? found.length + " places" : "Nothing has all of these words";
    results.appendChild(head);
    found.slice(0, 40).forEach(function (entry) {
      var place = document.createElement("article"), title = document.createElement("h3");
      var link = document.createElement("a");
      link.href = base + "/" + entry.location;
      var page = titles[entry.location.split("#")[0]];
      link.textContent = plain(entry.title) + (page === entry.title ? "" : " - " + plain(page));
      link.onclick = function () { field.value = ""; show(); };
      title.appendChild(link);
      place.appendChild(title);
      place.appendChild(piece(plain(entry.text), stem(words[0])));
      results.appendChild(place);
    });
    window.scrollTo(0, 0);
  }

  field.addEventListener("input", function () { load(show); });
  var asked = new URLSearchParams(location.search).get("q");
  if (asked) {
    field.value = asked;
    load(show);
  }
})();
