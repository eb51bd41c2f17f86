// Matches of a site, by `node dist/example/matches.js http://127.0.0.1:7070 office [KEY]`.

import { Client, Refused } from "../src/index.js";

const [url = "http://127.0.0.1:7070", site = "office", apiKey] = process.argv.slice(2);
const client = new Client(url, apiKey ? { apiKey } : {});

const about = await client.get("/v1/sites/{site}", { path: { site } });
console.log(`${about.site}: ${about.num_runs} runs, ${about.num_words} words`);

let count = 0;
for await (const match of client.all("/v1/sites/{site}/matches", { path: { site }, query: { limit: 50 } })) {
  count += 1;
  if (match.state === "verified" && count <= 3) {
    console.log(`${match.earlier.run} ${match.earlier.first} is ${match.later.run} ${match.later.first}`);
  }
}
console.log(`${count} matches`);

const picture = await client.download("/v1/sites/{site}/map/picture.png", { path: { site } });
console.log(`a picture of ${picture.size} bytes`);

const question = { words: [{ class: 4 }], limit: 3 };
const answers = await client.post("/v1/sites/{site}/queries/words", { path: { site }, body: question });
console.log(`${answers.length} places read like the question`);

try {
  await client.get("/v1/sites/{site}", { path: { site: "nowhere" } });
  throw new Error("a site that does not exist was answered");
} catch (error) {
  if (!(error instanceof Refused) || error.status !== 404) throw error;
}
