import { startMock, TOKEN } from './server';

const port = Number(process.env.PORT ?? 8765);
await startMock(port);
console.log(`http://127.0.0.1:${port}/#token=${TOKEN}`);
